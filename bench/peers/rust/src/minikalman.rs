// SPDX-License-Identifier: BSD-3-Clause
//! The EKF of the crate minikalman in double precision, on one of the models.
use crate::models::Model;
use crate::{run, Data, Job, Outcome};
use minikalman::extended::builder::{KalmanFilterBuilder, KalmanFilterObservationType, KalmanFilterType};
use minikalman::prelude::*;

struct Ekf<M, const N: usize, const P: usize> {
    model: M,
    filter: KalmanFilterType<N, f64>,
    measurement: KalmanFilterObservationType<N, P, f64>,
    y: Vec<Vec<f64>>,
    steps: usize,
}

fn array<const N: usize>(x: &[f64]) -> [f64; N] {
    core::array::from_fn(|i| x[i])
}

impl<M: Model<N, P>, const N: usize, const P: usize> Ekf<M, N, P> {
    fn new(model: M, data: &Data, steps: usize) -> Self {
        let builder = KalmanFilterBuilder::<N, f64>::default();
        let mut filter = builder.build();
        let mut measurement = builder.observations().build::<P>();
        filter.state_vector_mut().apply(|x| (0..N).for_each(|i| x.set_row(i, data.row("x0")[i])));
        let (p0, q, r) = (data.matrix::<N, N>("P0"), data.matrix::<N, N>("Q"), data.matrix::<P, P>("R"));
        filter.estimate_covariance_mut().apply(|m| (0..N * N).for_each(|k| m.set_at(k / N, k % N, p0[k / N][k % N])));
        filter.direct_process_noise_mut().apply(|m| (0..N * N).for_each(|k| m.set_at(k / N, k % N, q[k / N][k % N])));
        measurement
            .measurement_noise_covariance_mut()
            .apply(|m| (0..P * P).for_each(|k| m.set_at(k / P, k % P, r[k / P][k % P])));
        Ekf { model, filter, measurement, y: data.rows("y").clone(), steps }
    }
    fn step(&mut self, at: usize) {
        let model = &self.model;
        let f = model.dynamics_jacobian(&array(self.filter.state_vector().as_ref()));
        self.filter.state_transition_jacobian_mut().apply(|m| {
            for i in 0..N {
                for j in 0..N {
                    m.set_at(i, j, f[i][j]);
                }
            }
        });
        self.filter.predict_nonlinear(|x, next| {
            let out = model.dynamics(&array(x.as_ref()));
            for i in 0..N {
                next[i] = out[i];
            }
        });
        let h = model.measurement_jacobian(&array(self.filter.state_vector().as_ref()));
        self.measurement.observation_jacobian_matrix_mut().apply(|m| {
            for i in 0..P {
                for j in 0..N {
                    m.set_at(i, j, h[i][j]);
                }
            }
        });
        let y = &self.y[at];
        self.measurement.measurement_vector_mut().apply(|z| {
            for i in 0..P {
                z.set_row(i, y[i]);
            }
        });
        self.filter.correct_nonlinear(&mut self.measurement, |x, out| {
            let predicted = model.measurement(&array(x.as_ref()));
            for i in 0..P {
                out.set_row(i, predicted[i]);
            }
        });
    }
}

impl<M: Model<N, P>, const N: usize, const P: usize> Job for Ekf<M, N, P> {
    fn run(&mut self) {
        let mut at = 0;
        for _ in 0..self.steps {
            self.step(at);
            core::hint::black_box(&mut self.filter);
            at = if at + 1 == self.y.len() { 0 } else { at + 1 };
        }
    }
    fn outcome(&self) -> Outcome {
        let covariance = self.filter.estimate_covariance().as_matrix();
        Outcome {
            x: (0..N).map(|i| self.filter.state_vector().get_row(i)).collect(),
            variances: (0..N).map(|i| covariance.get_at(i, i)).collect(),
            // Its buffers lie on the heap: x, A, P, Q and two temporaries.
            state_bytes: size_of_val(&self.filter) + 8 * (2 * N + 4 * N * N),
            usable: true,
            ..Default::default()
        }
    }
}

pub fn main<M: Model<N, P>, const N: usize, const P: usize>(model: fn(&Data) -> M) {
    run("minikalman_ekf", |data, steps| Ekf::<M, N, P>::new(model(data), data, steps));
}
