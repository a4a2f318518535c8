// SPDX-License-Identifier: BSD-3-Clause
//! The models of tests/models, with the parameters of the data file.
use crate::Data;

pub trait Model<const N: usize, const P: usize> {
    fn dynamics(&self, x: &[f64; N]) -> [f64; N];
    fn dynamics_jacobian(&self, x: &[f64; N]) -> [[f64; N]; N];
    fn measurement(&self, x: &[f64; N]) -> [f64; P];
    fn measurement_jacobian(&self, x: &[f64; N]) -> [[f64; N]; P];
}

/// Van der Pol's oscillator and its saturating sensor of position.
pub struct VanDerPol {
    dt: f64,
    c: f64,
    k: f64,
}
impl VanDerPol {
    pub fn new(data: &Data) -> Self {
        VanDerPol { dt: data.number("dt"), c: data.number("c"), k: data.number("k") }
    }
}
impl Model<2, 1> for VanDerPol {
    fn dynamics(&self, x: &[f64; 2]) -> [f64; 2] {
        let acceleration = -self.k * x[0] - 2.0 * self.c * (x[0] * x[0] - 1.0) * x[1];
        [x[0] + self.dt * x[1], x[1] + self.dt * acceleration]
    }
    fn dynamics_jacobian(&self, x: &[f64; 2]) -> [[f64; 2]; 2] {
        let (dt, c) = (self.dt, self.c);
        [[1.0, dt], [-dt * (self.k + 4.0 * c * x[0] * x[1]), 1.0 - dt * 2.0 * c * (x[0] * x[0] - 1.0)]]
    }
    fn measurement(&self, x: &[f64; 2]) -> [f64; 1] {
        [x[0] / (1.0 + x[0] * x[0]).sqrt()]
    }
    fn measurement_jacobian(&self, x: &[f64; 2]) -> [[f64; 2]; 1] {
        let s = 1.0 + x[0] * x[0];
        [[1.0 / (s * s.sqrt()), 0.0]]
    }
}

/// A ballistic target with drag, and a radar: range, azimuth, elevation.
pub struct Radar {
    dt: f64,
    drag: f64,
    gravity: f64,
}
impl Radar {
    pub fn new(data: &Data) -> Self {
        Radar { dt: data.number("dt"), drag: data.number("drag"), gravity: data.number("gravity") }
    }
}
impl Model<6, 3> for Radar {
    fn dynamics(&self, x: &[f64; 6]) -> [f64; 6] {
        let keep = 1.0 - self.dt * self.drag * (x[3] * x[3] + x[4] * x[4] + x[5] * x[5]).sqrt();
        let mut out = [0.0; 6];
        for i in 0..3 {
            out[i] = x[i] + self.dt * x[3 + i];
            out[3 + i] = keep * x[3 + i];
        }
        out[5] -= self.dt * self.gravity;
        out
    }
    fn dynamics_jacobian(&self, x: &[f64; 6]) -> [[f64; 6]; 6] {
        let speed = (x[3] * x[3] + x[4] * x[4] + x[5] * x[5]).sqrt();
        let keep = 1.0 - self.dt * self.drag * speed;
        let factor = self.dt * self.drag / speed;
        let mut out = [[0.0; 6]; 6];
        for i in 0..3 {
            out[i][i] = 1.0;
            out[i][3 + i] = self.dt;
            out[3 + i][3 + i] = keep;
            for j in 0..3 {
                out[3 + i][3 + j] -= factor * x[3 + i] * x[3 + j];
            }
        }
        out
    }
    fn measurement(&self, x: &[f64; 6]) -> [f64; 3] {
        let ground = x[0] * x[0] + x[1] * x[1];
        [(ground + x[2] * x[2]).sqrt(), x[1].atan2(x[0]), x[2].atan2(ground.sqrt())]
    }
    fn measurement_jacobian(&self, x: &[f64; 6]) -> [[f64; 6]; 3] {
        let ground = x[0] * x[0] + x[1] * x[1];
        let squared = ground + x[2] * x[2];
        let distance = ground.sqrt();
        let inverse_range = 1.0 / squared.sqrt();
        let climb = x[2] / (squared * distance);
        let mut out = [[0.0; 6]; 3];
        for i in 0..3 {
            out[0][i] = x[i] * inverse_range;
        }
        out[1][0] = -x[1] / ground;
        out[1][1] = x[0] / ground;
        out[2][0] = -x[0] * climb;
        out[2][1] = -x[1] * climb;
        out[2][2] = distance / squared;
        out
    }
}

/// A dense, mildly nonlinear system.
pub struct Dense {
    a: [[f64; 15]; 15],
    h: [[f64; 15]; 6],
    bend_dynamics: f64,
    bend_sensor: f64,
}
impl Dense {
    pub fn new(data: &Data) -> Self {
        Dense {
            a: data.matrix("A"),
            h: data.matrix("H"),
            bend_dynamics: data.number("bend_dynamics"),
            bend_sensor: data.number("bend_sensor"),
        }
    }
    fn linear(&self, x: &[f64; 15]) -> [f64; 6] {
        core::array::from_fn(|i| (0..15).map(|j| self.h[i][j] * x[j]).sum())
    }
}
impl Model<15, 6> for Dense {
    fn dynamics(&self, x: &[f64; 15]) -> [f64; 15] {
        core::array::from_fn(|i| {
            let linear: f64 = (0..15).map(|j| self.a[i][j] * x[j]).sum();
            linear + self.bend_dynamics * x[i] * x[i] * x[i]
        })
    }
    fn dynamics_jacobian(&self, x: &[f64; 15]) -> [[f64; 15]; 15] {
        let mut out = self.a;
        for i in 0..15 {
            out[i][i] += 3.0 * self.bend_dynamics * x[i] * x[i];
        }
        out
    }
    fn measurement(&self, x: &[f64; 15]) -> [f64; 6] {
        self.linear(x).map(|z| z + self.bend_sensor * z * z * z)
    }
    fn measurement_jacobian(&self, x: &[f64; 15]) -> [[f64; 15]; 6] {
        let z = self.linear(x);
        core::array::from_fn(|i| self.h[i].map(|h| h * (1.0 + 3.0 * self.bend_sensor * z[i] * z[i])))
    }
}
