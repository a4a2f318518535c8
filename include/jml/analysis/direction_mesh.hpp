// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The mesh of directions of stability_region.hpp: two points (n = 1), a closed polygon (n = 2), a
/// triangulated sphere (n = 3). Vertices are numbers of rays; the mesh knows nothing of where they are.
#include <jml/warnings_begin.hpp>
#pragma once

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

namespace jml::detail {

/// Oriented simplices of n vertices each.
template <int n>
struct DirectionMesh {
  using Simplex = std::array<int, n>;
  std::vector<Simplex> simplices;

  /// The cross-polytope: vertex 2i is +e_i, vertex 2i+1 is -e_i; every simplex has det[v_0 … v_{n-1}] > 0.
  DirectionMesh() {
    for (int signs = 0; signs < (1 << n); ++signs) {
      Simplex simplex{};
      int negative = 0;
      for (int i = 0; i < n; ++i) {
        const int minus = (signs >> i) & 1;
        simplex[static_cast<std::size_t>(i)] = 2 * i + minus;
        negative += minus;
      }
      if constexpr (n > 1) {
        if (negative % 2 != 0) std::swap(simplex[0], simplex[1]);
      }
      simplices.push_back(simplex);
    }
  }

  /// Calls use(a, b) for every pair of neighbours, most of them more than once, over a copy of the mesh.
  template <typename Use>
  void edges(const Use& use) const {
    const std::vector<Simplex> frozen = simplices;
    for (const Simplex& simplex : frozen) {
      for (std::size_t i = 0; i + 1 < n; ++i) {
        for (std::size_t j = i + 1; j < n; ++j) use(simplex[i], simplex[j]);
      }
    }
  }

  [[nodiscard]] bool has(int a, int b) const {
    for (const Simplex& simplex : simplices) {
      const auto in = [&simplex](int v) {
        return std::find(simplex.begin(), simplex.end(), v) != simplex.end();
      };
      if (in(a) && in(b)) return true;
    }
    return false;
  }

  /// Puts vertex `middle` on the edge between a and b; false where there is no such edge.
  bool split(int a, int b, int middle) {
    const std::size_t before = simplices.size();
    bool found = false;
    for (std::size_t k = 0; k < before; ++k) {
      int at_a = -1, at_b = -1;
      for (int i = 0; i < n; ++i) {
        if (simplices[k][static_cast<std::size_t>(i)] == a) at_a = i;
        if (simplices[k][static_cast<std::size_t>(i)] == b) at_b = i;
      }
      if (at_a < 0 || at_b < 0) continue;
      found = true;
      Simplex other = simplices[k];
      other[static_cast<std::size_t>(at_a)] = middle;
      simplices[k][static_cast<std::size_t>(at_b)] = middle;
      simplices.push_back(other);
    }
    return found;
  }
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
