// SPDX-License-Identifier: BSD-3-Clause
// All studies in the order of the page.
#include "study.hpp"

namespace study {

const std::vector<Study>& studies() {
  static const std::vector<Study> all = [] {
    std::vector<Study> out;
    for (const auto family : {linear, van_der_pol, radar, reentry, bearings_only, growth, bounded}) {
      for (Study& one : family()) out.push_back(std::move(one));
    }
    return out;
  }();
  return all;
}

}  // namespace study
