// SPDX-License-Identifier: BSD-3-Clause
// What a radar does on its bad days, to EKFs: bare, behind a gate, and behind a gate with a policy. The rows
// are printed, and agree with the stored table; by night fault_table_of_all_test has those of every
// estimator.
#include <gtest/gtest.h>

#include "operations/fault_worlds.hpp"

namespace {

TEST(FaultTable, OfARadar) {
  const faults::RadarWorld world{};
  faults::Table table;
  const auto start = faults::RadarWorld::start();
  const auto plain = [&](const auto&) { return jml::Filter{jml::Ekf{}, world.target, start}; };
  const auto factored = [&](const auto&) {
    return jml::Filter{jml::Factored{jml::Ekf{}}, world.target, start};
  };
  faults::add_rows(world, "radar,EKF", plain, 5, table);
  faults::add_rows(world, "radar,EKF in factors", factored, 5, table);
  faults::expect_stored(table);
}

}  // namespace
