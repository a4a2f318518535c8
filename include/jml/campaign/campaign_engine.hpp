// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Runs the blocks of a campaign (component jml::campaign): threads, journal, progress. Knows no scenario and
/// no estimator, only blocks.
///
/// A block is computed by one thread, run after run, and blocks are added in the order of their numbers: the
/// sums are the same to the bit for any number of threads.
#include <jml/warnings_begin.hpp>
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <filesystem>
#include <jml/campaign/journal.hpp>
#include <jml/campaign/progress.hpp>
#include <map>
#include <mutex>
#include <thread>

namespace jml::detail {

/// Computes a block; leaves it half done where `stop` becomes true.
using BlockWorker = std::function<void(int block, BlockRecord&, const std::atomic<bool>& stop)>;

/// A campaign without its types.
struct CampaignPlan {
  CampaignData data;                         ///< sums and times are empty
  Json identity;                             ///< what a journal must agree on
  std::function<BlockWorker()> make_worker;  ///< called once in each thread
  /// Runs flown in this process, those of unfinished blocks too.
  std::shared_ptr<std::atomic<std::int64_t>> flown = std::make_shared<std::atomic<std::int64_t>>(0);
  std::string refusal;  ///< not empty: the options make no sense
};

/// The first run of a block; of `blocks` it is the number of runs.
[[nodiscard]] inline std::int64_t first_run(std::int64_t runs, int blocks, int block) {
  return block * (runs / blocks) + std::min<std::int64_t>(block, runs % blocks);
}

/// Why these options cannot be run; empty where they can. Cuts the blocks to the runs, and counts a part.
inline std::string check(CampaignData& d) {
  CampaignOptions& o = d.options;
  if (o.runs < 1 || o.runs > std::int64_t{1} << 53)
    return "a campaign of " + std::to_string(o.runs) + " runs: ask for at least 1 and at most 2^53";
  if (o.threads < 0 || o.threads > 4096)
    return std::to_string(o.threads) + " threads: ask for 1 to 4096, or 0 for as many as the machine has";
  if (o.blocks < 1 || o.blocks > 1'000'000) return std::to_string(o.blocks) + " blocks: ask for 1 to 1000000";
  if (d.layout.steps < 1 || d.layout.steps > 100'000'000)
    return "a scenario of " + std::to_string(d.layout.steps) + " steps: it needs 1 to 100000000";
  if (!(d.dt >= 0 && d.dt <= std::numeric_limits<double>::max()))
    return "the scenario's dt is negative or not finite";
  for (std::size_t i = 0; i < d.estimators.size(); ++i) {
    if (d.estimators[i].empty()) return "an estimator has no name";
    for (std::size_t j = 0; j < i; ++j) {
      if (d.estimators[i] == d.estimators[j]) return "two estimators are named " + d.estimators[i];
    }
  }
  o.blocks = static_cast<int>(std::min<std::int64_t>(o.blocks, o.runs));
  if (o.first < 0 || o.first >= o.blocks || o.count < 0 || o.count > o.blocks - o.first)
    return std::to_string(o.count) + " blocks from block " + std::to_string(o.first) +
           " on: the campaign has blocks 0 to " + std::to_string(o.blocks - 1);
  if (o.count == 0) o.count = o.blocks - o.first;
  return {};
}

inline int threads_wanted(const CampaignOptions& options) {
  return options.threads > 0 ? options.threads
                             : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

/// Threads that compute blocks. The owner's thread offers them and collects them.
class Crew {
 public:
  Crew(const CampaignPlan& plan, int threads) : plan_(plan) {
    try {
      for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { work(); });
    } catch (const std::exception& e) {
      if (threads_.empty()) error_ = std::string("no thread could be started: ") + e.what();
    }
  }
  Crew(const Crew&) = delete;
  Crew& operator=(const Crew&) = delete;
  /// Blocks under way are given up at the end of the run they are at.
  ~Crew() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    offered_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }

  [[nodiscard]] int size() const { return static_cast<int>(threads_.size()); }
  [[nodiscard]] const std::string& error() const { return error_; }  ///< no thread at all
  /// Blocks offered that have not come back.
  [[nodiscard]] int pending() const { return pending_; }

  void offer(int block) {
    ++pending_;
    {
      const std::lock_guard lock(mutex_);
      todo_.push_back(block);
    }
    offered_.notify_one();
  }
  /// A finished block, waited for no longer than `limit`.
  bool collect(BlockRecord& out, std::chrono::milliseconds limit) {
    std::unique_lock lock(mutex_);
    if (!finished_.wait_for(lock, limit, [this] { return !done_.empty(); })) return false;
    out = std::move(done_.front());
    done_.pop_front();
    --pending_;
    return true;
  }

 private:
  void work() {
    BlockWorker worker;
    for (;;) {
      int block = 0;
      {
        std::unique_lock lock(mutex_);
        offered_.wait(lock, [this] { return stop_ || !todo_.empty(); });
        if (stop_) return;
        block = todo_.front();
        todo_.pop_front();
      }
      BlockRecord record;
      try {
        if (!worker) worker = plan_.make_worker();
        worker(block, record, stop_);
      } catch (const std::exception& e) {
        record.failure = e.what();
      } catch (...) {
        record.failure = "an exception that is no std::exception";  // of the estimators' or scenario's copies
      }
      if (stop_) return;
      {
        const std::lock_guard lock(mutex_);
        done_.push_back(std::move(record));
      }
      finished_.notify_one();
    }
  }

  const CampaignPlan& plan_;
  std::mutex mutex_;
  std::condition_variable offered_, finished_;
  std::deque<int> todo_;
  std::deque<BlockRecord> done_;
  std::atomic<bool> stop_ = false;
  int pending_ = 0;  // of the owner's thread alone
  std::string error_;
  std::vector<std::thread> threads_;
};

/// Takes finished blocks in any order and adds them in theirs; keeps the journal.
class RunCollector {
 public:
  explicit RunCollector(const CampaignPlan& plan)
      : data_(std::make_shared<CampaignData>(plan.data)),
        flown_(plan.flown),
        have_(static_cast<std::size_t>(plan.data.options.blocks)),
        next_(plan.data.options.first),
        progress_(plan.data.options.progress, plan.data.scenario) {
    data_->sums.assign(data_->layout.size(), 0.0);
    data_->times.assign(data_->layout.time_size(), 0.0);
  }

  /// Takes over what the journal and those of the parts have. Not empty: why one of them cannot be used.
  std::string open(const CampaignPlan& plan) {
    const auto take = [this](BlockRecord&& r) { add(std::move(r)); };
    std::string error;
    if (const std::string& path = data_->options.journal; !path.empty())
      error = journal_.open(path, plan.identity, data_->layout, take);
    for (const std::string& part : data_->options.parts) {
      std::error_code none;  // its own journal may be among them
      if (journal_.is_open() && std::filesystem::equivalent(part, data_->options.journal, none)) continue;
      if (error.empty())
        error = Journal::read(part, plan.identity, data_->layout, [this](BlockRecord&& r) {
          if (wanted(r.block) && !have_[static_cast<std::size_t>(r.block)]) accept(std::move(r));
        });
    }
    data_->blocks_taken_over = count_;
    taken_over_ = elsewhere_;
    return error;
  }

  /// The blocks that are still to be computed.
  [[nodiscard]] std::deque<int> missing() const {
    std::deque<int> out;
    for (int b = data_->options.first; wanted(b); ++b) {
      if (!have_[static_cast<std::size_t>(b)]) out.push_back(b);
    }
    return out;
  }
  [[nodiscard]] bool complete() const { return count_ == data_->options.count; }

  /// A block of this process.
  void accept_own(BlockRecord&& record) {
    elsewhere_ -= runs_of(record.block);
    accept(std::move(record));
  }
  /// A block of another process.
  void accept(BlockRecord&& record) {
    if (journal_.is_open() && !journal_.add(to_bytes(record))) {
      warning_ = "the journal " + data_->options.journal +
                 " could not be written to the end: " + std::strerror(errno);
    }
    add(std::move(record));
  }
  void show_progress() {
    const CampaignOptions& o = data_->options;
    progress_.show({elsewhere_ + flown_->load(std::memory_order_relaxed), taken_over_,
                    first_run(o.runs, o.blocks, o.first + o.count) - first_run(o.runs, o.blocks, o.first),
                    0});
  }

  [[nodiscard]] CampaignData& data() { return *data_; }
  [[nodiscard]] const std::string& warning() const { return warning_; }
  [[nodiscard]] CampaignResult result(int threads) {
    data_->threads = threads;
    data_->wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    return CampaignResult(data_, warning_);
  }

 private:
  [[nodiscard]] bool wanted(int block) const {
    return block >= data_->options.first && block < data_->options.first + data_->options.count;
  }
  [[nodiscard]] std::int64_t runs_of(int block) const {
    const CampaignOptions& o = data_->options;
    return first_run(o.runs, o.blocks, block + 1) - first_run(o.runs, o.blocks, block);
  }
  void add(BlockRecord&& record) {
    const auto block = static_cast<std::size_t>(record.block);
    if (!wanted(record.block) || have_[block]) return;
    have_[block] = true;
    ++count_;
    elsewhere_ += runs_of(record.block);
    waiting_.emplace(record.block, std::move(record));
    for (; !waiting_.empty() && waiting_.begin()->first == next_; ++next_) {
      const BlockRecord& r = waiting_.begin()->second;
      for (std::size_t i = 0; i < r.sums.size(); ++i) data_->sums[i] += r.sums[i];
      for (std::size_t i = 0; i < r.times.size(); ++i) data_->times[i] += r.times[i];
      data_->faults.insert(data_->faults.end(), r.faults.begin(), r.faults.end());
      waiting_.erase(waiting_.begin());
    }
  }

  std::shared_ptr<CampaignData> data_;
  std::shared_ptr<std::atomic<std::int64_t>> flown_;
  std::vector<bool> have_;
  std::map<int, BlockRecord> waiting_;
  int count_ = 0, next_ = 0;
  std::int64_t elsewhere_ = 0, taken_over_ = 0;  // runs that this process has not flown
  Journal journal_;
  std::string warning_;
  Progress progress_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// The campaign in this process.
inline CampaignResult run_plan(const CampaignPlan& plan) {
  if (!plan.refusal.empty()) return CampaignResult(plan.refusal);
  RunCollector collector(plan);
  if (const std::string error = collector.open(plan); !error.empty()) return CampaignResult(error);
  std::deque<int> todo = collector.missing();
  const int threads = std::min(threads_wanted(plan.data.options), static_cast<int>(todo.size()));
  Crew crew(plan, threads);
  if (!crew.error().empty()) return CampaignResult(crew.error());
  BlockRecord record;
  while (!collector.complete()) {
    for (; !todo.empty() && crew.pending() < 2 * crew.size(); todo.pop_front()) crew.offer(todo.front());
    if (crew.collect(record, std::chrono::milliseconds(250))) {
      if (!record.failure.empty()) return CampaignResult(record.failure);
      collector.accept_own(std::move(record));
    }
    collector.show_progress();
  }
  return collector.result(threads);
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
