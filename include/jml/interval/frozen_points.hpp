// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What freeze() makes anew of a node in charts, as a copy: the w that its step is linearised about with the
/// slope there, and of each record the v with what follows from it, and R. A minimisation that is refused
/// gives them back bit by bit.
#include <jml/warnings_begin.hpp>
#pragma once

#include <array>
#include <jml/interval/nodes.hpp>
#include <jml/model/part.hpp>
#include <utility>

namespace jml::detail {

template <typename Record>
struct FrozenRecord {
  decltype(Record::R) R = Record().R;
  [[no_unique_address]] std::remove_cvref_t<decltype(whole_of(std::declval<Record&>().sensor).point)> point{};
};

/// Of a `Node` with room for a std::array of records of each sensor type, `Slots`.
template <typename Node, typename... Slots>
class FrozenNode {
 public:
  template <typename Of>
  void take(const Of& node) {
    each(*this, node, [](auto& kept, const auto& now) { kept = now; });
  }
  template <typename Of>
  void give(Of& node) const {
    each(*this, node, [](const auto& kept, auto& now) { now = kept; });
  }

 private:
  /// use(what is kept, what of the node it was).
  template <typename Self, typename Of, typename Use>
  static void each(Self& self, Of& node, const Use& use) {
    use(self.noise_, node.noise);
    use(self.w_, node.context.w);
    [&]<std::size_t... type>(std::index_sequence<type...>) {
      const auto of_type = [&](auto& kept, auto& records, std::size_t count) {
        for (std::size_t i = 0; i < count; ++i) {
          use(kept[i].R, records[i].R);
          use(kept[i].point, whole_of(records[i].sensor).point);
        }
      };
      (of_type(std::get<type>(self.records_), std::get<type>(node.slots), node.count[type]), ...);
    }(std::index_sequence_for<Slots...>{});
  }

  [[no_unique_address]] decltype(Node::noise) noise_{};
  decltype(Node::At::w) w_ = kernel::zeros<decltype(Node::At::w)>();
  std::tuple<std::array<FrozenRecord<typename Slots::value_type>, std::tuple_size_v<Slots>>...> records_{};
};

/// Of so many nodes; Nothing where they are not in charts.
template <bool in_charts, int size, typename Node, typename... Slots>
struct FrozenNodes {
  using type = Nothing;
};
template <int size, typename Node, typename... Slots>
struct FrozenNodes<true, size, Node, Slots...> {
  using type = std::array<FrozenNode<Node, Slots...>, static_cast<std::size_t>(size)>;
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
