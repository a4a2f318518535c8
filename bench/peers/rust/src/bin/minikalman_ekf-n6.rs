// SPDX-License-Identifier: BSD-3-Clause
fn main() {
    jml_peers::minikalman::main::<_, 6, 3>(jml_peers::models::Radar::new);
}
