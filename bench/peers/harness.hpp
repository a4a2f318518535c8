// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What every contender written in C++ shares: the data file, the clock, the count of allocations, the line
/// it prints. The protocol, for contenders in any language, is in README.md beside this file.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace peers {

/// A data file: lines of a name and numbers with commas between. A name may come more than once (`y`).
class Data {
 public:
  explicit Data(const std::string& path);
  /// The rows of `name`; ends the program where there are none.
  [[nodiscard]] const std::vector<std::vector<double>>& rows(const std::string& name) const;
  /// The first row of `name`.
  [[nodiscard]] const std::vector<double>& row(const std::string& name) const { return rows(name).front(); }
  [[nodiscard]] double number(const std::string& name) const { return row(name).front(); }
  /// Name of the contest: that of the file without directory and ending.
  [[nodiscard]] const std::string& contest() const { return contest_; }

 private:
  std::string contest_;
  std::map<std::string, std::vector<std::vector<double>>> rows_;
};

/// What a run leaves: the numbers that are compared before any time is.
struct Result {
  std::vector<double> x, P_diagonal;
  std::map<std::string, double> more{};  ///< e.g. {"rmse_position", 1.2}
  std::size_t state_bytes = 0;           ///< of what is carried from step to step, the model left out
  bool usable = true;                    ///< false where the contender itself reported a failure
};

/// One repeat: made outside the clock, run inside it, asked afterwards.
struct Job {
  virtual ~Job() = default;
  virtual void run() = 0;
  [[nodiscard]] virtual Result result() const = 0;
};

/// A job of `steps` steps.
using Make = Job* (*)(const Data& data, long steps);

/// The whole program: `contender DATA STEPS REPEAT`, or `contender DATA STEPS count` under
/// count_instructions.
int run(int argc, char** argv, const char* name, Make make);

/// The value is taken as read and written here: what led to it is not optimised away.
template <typename T>
inline void keep(T& value) {
  asm volatile("" : : "g"(&value) : "memory");
}

}  // namespace peers
