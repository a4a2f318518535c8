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
#include <cstdio>
#include <deque>
#include <exception>
#include <jml/campaign/journal.hpp>
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
  std::string refusal;                       ///< not empty: the options make no sense
};

/// Why these options cannot be run; empty where they can. Cuts the blocks to the runs.
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

/// One line on stderr that is written over, four times a second at most; silent unless that is a terminal.
class Progress {
 public:
  Progress(bool wanted, std::string name)
      : on_(wanted && ::isatty(STDERR_FILENO) == 1), name_(std::move(name)) {}
  ~Progress() {
    if (shown_) std::fputc('\n', stderr);
  }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `taken_over` of the `done` blocks took no time.
  void show(std::size_t done, std::size_t taken_over, std::size_t all) {
    if (!on_) return;
    const auto now = Clock::now();
    if (shown_ && now - last_ < std::chrono::milliseconds(250) && done < all) return;
    last_ = now;
    shown_ = true;
    const double spent = std::chrono::duration<double>(now - start_).count();
    std::fprintf(stderr, "\r%s: %zu of %zu blocks, %.0f s", name_.c_str(), done, all, spent);
    if (done > taken_over) {
      const double left = spent / static_cast<double>(done - taken_over) * static_cast<double>(all - done);
      std::fprintf(stderr, ", %.0f s left ", left);
    }
    std::fputs("\033[K", stderr);
    std::fflush(stderr);
  }

 private:
  using Clock = std::chrono::steady_clock;
  bool on_, shown_ = false;
  std::string name_;
  Clock::time_point start_ = Clock::now(), last_ = start_;
};

/// Takes finished blocks in any order and adds them in theirs; keeps the journal.
class RunCollector {
 public:
  explicit RunCollector(const CampaignPlan& plan)
      : data_(std::make_shared<CampaignData>(plan.data)),
        have_(static_cast<std::size_t>(plan.data.options.blocks)),
        progress_(plan.data.options.progress, plan.data.scenario) {
    data_->sums.assign(data_->layout.size(), 0.0);
    data_->times.assign(data_->layout.time_size(), 0.0);
  }

  /// Not empty: why the journal cannot be used.
  std::string open(const CampaignPlan& plan) {
    const std::string& path = data_->options.journal;
    if (path.empty()) return {};
    std::string error =
        journal_.open(path, plan.identity, data_->layout, [this](BlockRecord&& r) { add(std::move(r)); });
    data_->blocks_taken_over = static_cast<std::int64_t>(count_);
    return error;
  }

  /// The blocks that are still to be computed.
  [[nodiscard]] std::deque<int> missing() const {
    std::deque<int> out;
    for (std::size_t b = 0; b < have_.size(); ++b) {
      if (!have_[b]) out.push_back(static_cast<int>(b));
    }
    return out;
  }
  [[nodiscard]] bool complete() const { return count_ == have_.size(); }

  void accept(BlockRecord&& record) {
    if (journal_.is_open() && !journal_.add(to_bytes(record))) {
      warning_ = "the journal " + data_->options.journal +
                 " could not be written to the end: " + std::strerror(errno);
    }
    add(std::move(record));
  }
  void show_progress() {
    progress_.show(count_, static_cast<std::size_t>(data_->blocks_taken_over), have_.size());
  }

  [[nodiscard]] CampaignData& data() { return *data_; }
  [[nodiscard]] const std::string& warning() const { return warning_; }
  [[nodiscard]] CampaignResult result(int threads) {
    data_->threads = threads;
    data_->wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    return CampaignResult(data_, warning_);
  }

 private:
  void add(BlockRecord&& record) {
    const auto block = static_cast<std::size_t>(record.block);
    if (record.block < 0 || block >= have_.size() || have_[block]) return;
    have_[block] = true;
    ++count_;
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
  std::vector<bool> have_;
  std::map<int, BlockRecord> waiting_;
  std::size_t count_ = 0;
  int next_ = 0;
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
      collector.accept(std::move(record));
    }
    collector.show_progress();
  }
  return collector.result(threads);
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
