// SPDX-License-Identifier: BSD-3-Clause
//! The harness around no filter: what is subtracted from the size of a contender.
use jml_peers::{run, Job, Outcome};

struct Nothing(f64, usize);
impl Job for Nothing {
    fn run(&mut self) {
        for _ in 0..self.1 {
            core::hint::black_box(&mut self.0);
        }
    }
    fn outcome(&self) -> Outcome {
        Outcome { x: vec![self.0], usable: true, ..Default::default() }
    }
}

fn main() {
    run("nothing", |data, steps| Nothing(data.number("x0"), steps));
}
