// SPDX-License-Identifier: BSD-3-Clause
//! The crate fusion-nav: its own 15-state error-state filter, in single precision, with the noise densities, the start
//! and the measurement noise of the contest. What its model has and the contest's has not is switched off where it can be:
//! correlation of the receiver's errors, the yaw estimator, the hold without aiding. Its gates (99.9 %) and its history
//! for late measurements stay.
use fusion_nav::prelude::*;
use fusion_nav::Quaternion;
use jml_peers::{run, Data, Job, Outcome};

const START: u64 = 1_000_000; // µs: its clock must not start at zero

struct Strapdown {
    filter: Eskf,
    imu: Vec<ImuSample>,
    fixes: Vec<(Timestamp, Position<Ned>, Velocity<Ned>)>,
    truth: Vec<Vec<f64>>,
    estimates: Vec<State>,
    position_noise: PositionNoise<Ned>,
    velocity_noise: VelocityNoise<Ned>,
    antenna: Position<Body>,
    every: usize,
    steps: usize,
    refused: usize,
}

fn single(x: &[f64]) -> [f32; 3] {
    [x[0] as f32, x[1] as f32, x[2] as f32]
}
/// Local axes with z up (east, north, up to this crate) and body axes forward, left, up.
fn at(k: usize, dt: f64) -> Timestamp {
    Timestamp::from_micros(START + (k as f64 * dt * 1e6).round() as u64)
}

impl Strapdown {
    fn new(data: &Data, steps: usize) -> Self {
        let (dt, every) = (data.number("dt"), data.number("every") as usize);
        let grade = data.row("grade");
        let config = Config {
            imu: ImuNoise {
                gyro_white: grade[0] as f32,
                accel_white: grade[1] as f32,
                gyro_bias_walk: grade[2] as f32,
                accel_bias_walk: grade[3] as f32,
            },
            gravity: data.number("gravity") as f32,
            correlation: Correlation::WHITE,
            hold: None,
            yaw_estimator: false,
            ..Config::default()
        };
        let mut filter = Eskf::new(config).expect("a valid configuration");
        let x = data.row("x0");
        let [e, n, u] = single(&x[4..7]);
        let [ve, vn, vu] = single(&x[7..10]);
        let [gf, gl, gu] = single(&x[10..13]);
        let [af, al, au] = single(&x[13..16]);
        let seed = State {
            attitude: Attitude::from_flu_to_enu(Quaternion {
                w: x[0] as f32,
                x: x[1] as f32,
                y: x[2] as f32,
                z: x[3] as f32,
            }),
            position: Position::enu(e, n, u).to_ned(),
            velocity: Velocity::enu(ve, vn, vu).to_ned(),
            accel_bias: Acceleration::flu(af, al, au),
            gyro_bias: AngularRate::flu(gf, gl, gu),
            ..State::default()
        };
        // Of attitude, position, velocity, gyro bias, accelerometer bias here; there position, velocity, attitude,
        // accelerometer bias, gyro bias. Each block's horizontal components are alike, so that no axes are changed.
        let variance = data.row("P0_diagonal");
        let mut sigmas = [0.0_f32; 15];
        for (to, from) in [(0, 3), (3, 6), (6, 0), (9, 12), (12, 9)] {
            for i in 0..3 {
                sigmas[to + i] = variance[from + i].sqrt() as f32;
            }
        }
        let _: Alignment = filter.initialize_from(seed, Covariance::from_sigmas(sigmas), at(0, dt)).expect("a start");
        let imu = data.rows("imu").iter().enumerate().map(|(k, row)| {
            let ([f, l, u], [af, al, au]) = (single(&row[0..3]), single(&row[3..6]));
            let (rate, force) = (AngularRate::flu(f, l, u), Acceleration::flu(af, al, au));
            ImuSample::from_rates(at(k + 1, dt), rate, force, Seconds::from_secs(dt as f32))
        });
        let fixes = data.rows("gnss").iter().enumerate().map(|(k, row)| {
            let ([e, n, u], [ve, vn, vu]) = (single(&row[0..3]), single(&row[3..6]));
            (at((k + 1) * every, dt), Position::enu(e, n, u).to_ned(), Velocity::enu(ve, vn, vu).to_ned())
        });
        let sigma = data.row("gnss_sigma");
        let arm = data.row("arm");
        Strapdown {
            filter,
            imu: imu.collect(),
            fixes: fixes.collect(),
            truth: data.rows("truth").clone(),
            estimates: Vec::with_capacity(data.rows("gnss").len()),
            position_noise: PositionNoise::horizontal_vertical(sigma[0] as f32, sigma[1] as f32),
            velocity_noise: VelocityNoise::horizontal_vertical(sigma[2] as f32, sigma[3] as f32),
            antenna: Position::flu(arm[0] as f32, arm[1] as f32, arm[2] as f32),
            every,
            steps,
            refused: 0,
        }
    }
}

/// What navigation::Space::minus gives of attitude: the rotation vector between two quaternions, its square.
fn angle_squared(a: &[f64], b: &[f64]) -> f64 {
    let dot: f64 = (0..4).map(|i| a[i] * b[i]).sum::<f64>().abs().min(1.0);
    (2.0 * dot.acos()).powi(2)
}

impl Job for Strapdown {
    fn run(&mut self) {
        let (mut until, mut fix) = (self.every, 0);
        for k in 0..self.steps {
            self.refused += usize::from(!self.filter.predict(self.imu[k]).is_propagated());
            until -= 1;
            if until > 0 {
                continue;
            }
            until = self.every;
            let (time, position, velocity) = self.fixes[fix];
            fix += 1;
            let placed = self.filter.fuse_gnss_position(time, position, self.position_noise, self.antenna);
            let moved = self.filter.fuse_gnss_velocity(time, velocity, self.velocity_noise, self.antenna);
            self.refused += usize::from(!placed.is_accepted()) + usize::from(!moved.is_accepted());
            self.estimates.push(self.filter.state());
        }
        core::hint::black_box(&mut self.filter);
    }
    fn outcome(&self) -> Outcome {
        let (mut position, mut angle, mut counted) = (0.0, 0.0, 0);
        for (estimate, truth) in self.estimates.iter().zip(&self.truth).skip(self.estimates.len() / 6) {
            let [e, n, u] = estimate.position.to_enu().to_array();
            position += [e, n, u].iter().zip(&truth[4..7]).map(|(a, b)| (f64::from(*a) - b).powi(2)).sum::<f64>();
            let q = estimate.attitude.flu_to_enu();
            let q = [q.w, q.x, q.y, q.z].map(f64::from);
            angle += angle_squared(&q, &truth[0..4]);
            counted += 1;
        }
        let counted = f64::from(counted.max(1));
        let state = self.filter.state();
        let [e, n, u] = state.position.to_enu().to_array();
        Outcome {
            x: vec![f64::from(e), f64::from(n), f64::from(u)],
            variances: (0..3).map(|i| f64::from(self.filter.covariance().to_rows()[i][i])).collect(),
            more: vec![
                ("rms_position_m", (position / counted).sqrt()),
                ("rms_attitude_mrad", 1e3 * (angle / counted).sqrt()),
                ("refused", self.refused as f64),
            ],
            state_bytes: size_of::<Eskf>(),
            usable: true,
        }
    }
}

fn main() {
    run("fusion_nav", Strapdown::new);
}
