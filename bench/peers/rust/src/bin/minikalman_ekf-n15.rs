// SPDX-License-Identifier: BSD-3-Clause
fn main() {
    jml_peers::minikalman::main::<_, 15, 6>(jml_peers::models::Dense::new);
}
