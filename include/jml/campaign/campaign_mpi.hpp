// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A campaign on many machines (component jml::mpi): blocks are dealt to MPI ranks, each with threads of its
/// own; rank 0 collects them and keeps journal and files.
///
/// Ranks ask for blocks as they finish them. Blocks are added in the order of their numbers on rank 0, so the
/// result is that of the plain run. Across machines the bits are equal where their mathematical libraries
/// answer alike.
#include <jml/warnings_begin.hpp>
#pragma once

// The C interface alone.
#ifndef OMPI_SKIP_MPICXX
#define OMPI_SKIP_MPICXX 1
#endif
#ifndef MPICH_SKIP_MPICXX
#define MPICH_SKIP_MPICXX 1
#endif
#include <mpi.h>

#include <jml/campaign/campaign.hpp>

namespace jml {

/// MPI from here to the end of the scope, with the thread level that a campaign needs.
class MpiSession {
 public:
  /// Of main's arguments.
  MpiSession(int* count, char*** arguments) {
    int provided = 0;
    MPI_Init_thread(count, arguments, MPI_THREAD_FUNNELED, &provided);
  }
  ~MpiSession() { MPI_Finalize(); }
  MpiSession(const MpiSession&) = delete;
  MpiSession& operator=(const MpiSession&) = delete;
};

namespace detail {

/// A communicator of the campaign's own: its messages meet no others.
class Ranks {
 public:
  explicit Ranks(MPI_Comm other) {
    MPI_Comm_dup(other, &comm_);
    MPI_Comm_rank(comm_, &rank_);
    MPI_Comm_size(comm_, &size_);
  }
  ~Ranks() { MPI_Comm_free(&comm_); }
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  [[nodiscard]] int rank() const { return rank_; }
  [[nodiscard]] int size() const { return size_; }

  /// True where it is on every rank.
  [[nodiscard]] bool all(bool here) const {
    int mine = here ? 1 : 0, every = 0;
    MPI_Allreduce(&mine, &every, 1, MPI_INT, MPI_MIN, comm_);
    return every == 1;
  }
  [[nodiscard]] int sum(int here) const {
    int total = 0;
    MPI_Allreduce(&here, &total, 1, MPI_INT, MPI_SUM, comm_);
    return total;
  }
  /// Rank 0's bytes, on all.
  template <typename Container>
  void share(Container& bytes) const {
    std::uint64_t size = bytes.size();
    MPI_Bcast(&size, 1, MPI_UINT64_T, 0, comm_);
    bytes.resize(size);
    constexpr std::uint64_t piece = std::uint64_t{1} << 28;
    for (std::uint64_t at = 0; at < size; at += piece)
      MPI_Bcast(bytes.data() + at, static_cast<int>(std::min(piece, size - at)), MPI_CHAR, 0, comm_);
  }

  void send(int to, int tag, const void* bytes, std::size_t size) const {
    MPI_Send(bytes, static_cast<int>(size), MPI_CHAR, to, tag, comm_);
  }
  /// A message that is there, if there is one.
  bool receive(Bytes& bytes, int& from, int& tag) const {
    MPI_Status status;
    int there = 0, size = 0;
    MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, comm_, &there, &status);
    if (!there) return false;
    MPI_Get_count(&status, MPI_CHAR, &size);
    bytes.resize(static_cast<std::size_t>(size));
    from = status.MPI_SOURCE;
    tag = status.MPI_TAG;
    MPI_Recv(bytes.data(), size, MPI_CHAR, from, tag, comm_, MPI_STATUS_IGNORE);
    return true;
  }

 private:
  MPI_Comm comm_ = MPI_COMM_NULL;
  int rank_ = 0, size_ = 1;
};

/// Messages to rank 0: a block is asked for, finished; the rank cannot go on (with the reason); it leaves.
/// From rank 0: a block, or one of the two numbers below.
enum MpiTag : int { asks, finished, broken, leaves, order };
constexpr int no_more = -1, give_up = -2;

/// What one of the other ranks does until rank 0 has no more blocks.
inline void follow(const CampaignPlan& plan, const Ranks& ranks) {
  std::string error;
  try {
    const int threads = std::min(threads_wanted(plan.data.options), plan.data.options.blocks);
    Crew crew(plan, threads);
    error = crew.error();
    int asked = 0, from = 0, tag = 0;
    bool more = true;
    Bytes message;
    BlockRecord record;
    while (error.empty() && (more || asked > 0 || crew.pending() > 0)) {
      for (; more && crew.pending() + asked < crew.size() + 1; ++asked) ranks.send(0, asks, nullptr, 0);
      while (ranks.receive(message, from, tag)) {
        int block = no_more;
        std::memcpy(&block, message.data(), sizeof block);
        --asked;
        if (block >= 0) crew.offer(block);
        more &= block >= 0;
        if (block == give_up) return ranks.send(0, leaves, nullptr, 0);
      }
      if (!crew.collect(record, std::chrono::milliseconds(1))) continue;
      error = record.failure;
      if (!error.empty()) break;
      message = to_bytes(record);
      if (message.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()))
        error = "a block is larger than an MPI message may be: ask for fewer steps or estimators at a time";
      else
        ranks.send(0, finished, message.data(), message.size());
    }
  } catch (const std::exception& e) {
    error = std::string("the campaign stopped: ") + e.what();
  }
  if (!error.empty()) ranks.send(0, broken, error.data(), error.size());
  ranks.send(0, leaves, nullptr, 0);
}

/// What rank 0 does: deals, computes with its own threads, collects. Not empty: why the campaign stopped.
inline std::string lead(const CampaignPlan& plan, const Ranks& ranks, RunCollector& collector) {
  std::string error;
  std::deque<int> todo = collector.missing();
  const int threads = std::min(threads_wanted(plan.data.options), static_cast<int>(todo.size()));
  Crew crew(plan, threads);
  error = crew.error();
  Bytes message;
  BlockRecord record;
  int here = 1, from = 0, tag = 0;  // ranks that have not left, this one among them
  const auto handle = [&] {
    if (tag == asks) {
      int block = !error.empty() ? give_up : todo.empty() ? no_more : todo.front();
      if (block >= 0) todo.pop_front();
      ranks.send(from, order, &block, sizeof block);
    } else if (tag == finished) {
      if (!from_bytes(message, plan.data.layout, record))
        throw std::runtime_error("rank " + std::to_string(from) + " sent what is no block");
      collector.accept(std::move(record));
    } else if (tag == broken) {
      if (error.empty()) error.assign(message.begin(), message.end());
    } else if (tag == leaves) {
      --here;
    }
  };
  here = ranks.size();
  while (here > 1 || (error.empty() && !collector.complete())) {
    try {
      for (; error.empty() && !todo.empty() && crew.pending() < crew.size() + 1; todo.pop_front())
        crew.offer(todo.front());
      while (ranks.receive(message, from, tag)) handle();
      if (crew.collect(record, std::chrono::milliseconds(ranks.size() > 1 ? 1 : 250))) {
        if (record.failure.empty())
          collector.accept_own(std::move(record));
        else if (error.empty())
          error = record.failure;
      }
      collector.show_progress();
    } catch (const std::exception& e) {
      if (error.empty()) error = std::string("the campaign stopped: ") + e.what();
    }
  }
  return error;
}

inline CampaignResult run_plan_on_ranks(const CampaignPlan& plan, MPI_Comm comm) {
  int initialised = 0, level = MPI_THREAD_SINGLE;
  MPI_Initialized(&initialised);
  if (initialised) MPI_Query_thread(&level);
  if (level < MPI_THREAD_FUNNELED)
    return CampaignResult("MPI was not started with MPI_THREAD_FUNNELED: make a jml::MpiSession in main");
  const Ranks ranks(comm);

  std::string identity = plan.identity.dump(-1, ' ', false, Json::error_handler_t::replace) + plan.refusal;
  const std::string mine = identity;
  ranks.share(identity);
  if (!ranks.all(identity == mine)) return CampaignResult("the ranks do not run the same campaign");
  if (!plan.refusal.empty()) return CampaignResult(plan.refusal);

  std::optional<RunCollector> collector;
  std::string error;
  const bool first = ranks.rank() == 0;
  if (first) {
    collector.emplace(plan);
    try {  // the others wait for the answer
      error = collector->open(plan);
    } catch (const std::exception& e) {
      error = e.what();
    }
  }
  ranks.share(error);
  if (!error.empty()) return CampaignResult(error);
  if (first)
    error = lead(plan, ranks, *collector);
  else
    follow(plan, ranks);
  ranks.share(error);
  const int threads = ranks.sum(threads_wanted(plan.data.options));
  if (!error.empty()) return CampaignResult(error);

  // Every rank has the figures; rank 0 writes the files.
  BlockRecord total;
  Bytes bytes;
  if (first) {
    const CampaignData& d = collector->data();
    total.block = static_cast<int>(d.blocks_taken_over);
    total.sums.assign(d.sums.begin(), d.sums.end());
    total.times = d.times;
    total.faults = d.faults;
    bytes = to_bytes(total);
    collector->data().ranks = ranks.size();
  }
  ranks.share(bytes);
  if (first) return collector->result(threads);
  const auto data = std::make_shared<CampaignData>(plan.data);
  from_bytes(bytes, plan.data.layout, total);
  data->blocks_taken_over = total.block;
  data->sums.assign(total.sums.begin(), total.sums.end());
  data->times = total.times;
  data->faults = total.faults;
  data->threads = threads;
  data->ranks = ranks.size();
  return CampaignResult(data, {}, false);
}

}  // namespace detail

/// campaign.run() on all ranks of `comm`, which all call it with the same campaign. Each rank uses
/// options.threads threads; MPI is called from this thread alone. The journal is read and written on rank 0,
/// no disk is shared. Every rank has the result; the write_ functions write on rank 0 only.
template <typename Scenario, typename... E>
[[nodiscard]] CampaignResult run_on_ranks(const Campaign<Scenario, E...>& campaign,
                                          MPI_Comm comm = MPI_COMM_WORLD) {
  try {
    return detail::run_plan_on_ranks(campaign.plan(), comm);
  } catch (const std::exception& e) {
    return CampaignResult(std::string("the campaign stopped: ") + e.what());
  }
}

}  // namespace jml
#include <jml/warnings_end.hpp>
