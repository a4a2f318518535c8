// SPDX-License-Identifier: BSD-3-Clause
fn main() {
    jml_peers::minikalman::main::<_, 2, 1>(jml_peers::models::VanDerPol::new);
}
