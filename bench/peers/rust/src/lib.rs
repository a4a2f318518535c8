// SPDX-License-Identifier: BSD-3-Clause
//! What harness.hpp is for contenders in C++: data, clock, count of allocations, the printed line.
use std::alloc::{GlobalAlloc, Layout, System};
use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::Instant;

pub mod minikalman;
pub mod models;

struct Counting;
static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Relaxed);
        System.alloc(layout)
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        System.dealloc(pointer, layout)
    }
}
#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// A data file: rows of numbers by name.
pub struct Data {
    pub contest: String,
    rows: HashMap<String, Vec<Vec<f64>>>,
}

impl Data {
    pub fn read(path: &str) -> Self {
        let text = std::fs::read_to_string(path).expect("a data file");
        let mut rows: HashMap<String, Vec<Vec<f64>>> = HashMap::new();
        for line in text.lines().filter(|line| !line.starts_with('#')) {
            let mut cells = line.split(',');
            let name = cells.next().unwrap_or_default().to_string();
            rows.entry(name).or_default().push(cells.map(|cell| cell.parse().expect("a number")).collect());
        }
        let contest = std::path::Path::new(path).file_stem().unwrap().to_string_lossy().into_owned();
        Data { contest, rows }
    }
    pub fn rows(&self, name: &str) -> &Vec<Vec<f64>> {
        &self.rows[name]
    }
    pub fn row(&self, name: &str) -> &Vec<f64> {
        &self.rows[name][0]
    }
    pub fn number(&self, name: &str) -> f64 {
        self.row(name)[0]
    }
    pub fn matrix<const R: usize, const C: usize>(&self, name: &str) -> [[f64; C]; R] {
        let flat = self.row(name);
        core::array::from_fn(|i| core::array::from_fn(|j| flat[C * i + j]))
    }
}

#[derive(Default)]
pub struct Outcome {
    pub x: Vec<f64>,
    pub variances: Vec<f64>,
    pub more: Vec<(&'static str, f64)>,
    pub state_bytes: usize,
    pub usable: bool,
}

/// One repeat: made outside the clock, run inside it, asked afterwards.
pub trait Job {
    fn run(&mut self);
    fn outcome(&self) -> Outcome;
}

#[cfg(target_arch = "x86_64")]
fn mark() {
    unsafe { core::arch::asm!("int3") }
}
#[cfg(not(target_arch = "x86_64"))]
fn mark() {
    panic!("instructions are counted on x86-64 alone");
}

fn list(values: &[f64]) -> String {
    values.iter().map(|value| format!("{value:.16e}")).collect::<Vec<_>>().join(",")
}

fn peak_kb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).unwrap_or("0");
    line.split_whitespace().find_map(|word| word.parse().ok()).unwrap_or(0)
}

/// The whole program: `contender DATA STEPS REPEAT`, or `contender DATA STEPS count`.
pub fn run<J: Job>(name: &str, make: impl Fn(&Data, usize) -> J) {
    let arguments: Vec<String> = std::env::args().collect();
    assert_eq!(arguments.len(), 4, "usage: contender DATA STEPS REPEAT");
    let data = Data::read(&arguments[1]);
    let steps: usize = arguments[2].parse().expect("a number of steps");
    if arguments[3] == "count" {
        make(&data, steps).run();
        for some in [steps / 4, steps] {
            let mut job = make(&data, some);
            mark();
            job.run();
            mark();
        }
        return;
    }
    let repeats: usize = arguments[3].parse().expect("a number of repeats");
    let mut times = Vec::new();
    let mut allocated = 0;
    let mut outcome = Outcome::default();
    for _ in 0..repeats.max(1) {
        let mut job = make(&data, steps);
        let before = ALLOCATIONS.load(Relaxed);
        let start = Instant::now();
        job.run();
        let elapsed = start.elapsed();
        allocated = ALLOCATIONS.load(Relaxed) - before;
        times.push(elapsed.as_nanos() as f64 / steps as f64);
        outcome = job.outcome();
    }
    times.sort_by(f64::total_cmp);
    let more: String = outcome.more.iter().map(|(key, value)| format!(",\"{key}\":{value:.16e}")).collect();
    println!(
        "{{\"contender\":\"{name}\",\"contest\":\"{}\",\"compiler\":\"rustc\",\"flags\":\"{}\",\"steps\":{steps},\
         \"ns_per_step\":{},\"allocations_per_step\":{},\"peak_kb\":{},\"state_bytes\":{},\"usable\":{}{more},\
         \"x\":[{}],\"P_diagonal\":[{}]}}",
        data.contest,
        option_env!("JML_PEER_FLAGS").unwrap_or(""),
        times[times.len() / 2],
        allocated as f64 / steps as f64,
        peak_kb(),
        outcome.state_bytes,
        outcome.usable,
        list(&outcome.x),
        list(&outcome.variances)
    );
}
