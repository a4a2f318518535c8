// SPDX-License-Identifier: BSD-3-Clause
// The long run of the generator that tries to break the claim that a usable status is never given over a wrong
// covariance or state: covariance_generator [problems [seed [threads [forms]]]], forms of p(lain), f(actored) and
// i(nterval); all of them by default. Exit code 1 if any answer in double is wrong.
#include <chrono>
#include <cstdlib>
#include <thread>

#include "rounding/tally.hpp"

int main(int argc, char** argv) {
  using namespace rounding;
  const auto argument = [&](int i, unsigned long long otherwise) {
    return argc > i ? std::strtoull(argv[i], nullptr, 10) : otherwise;
  };
  const std::uint64_t count = argument(1, 1'000'000), seed = argument(2, 1);
  const auto threads = static_cast<std::size_t>(argument(3, std::max(1U, std::thread::hardware_concurrency())));
  const std::string which = argc > 4 ? argv[4] : "pfi";
  const auto has = [&](char form) { return which.find(form) != std::string::npos; };
  const Which flown{has('p'), has('f'), has('i')};
  const auto begin = std::chrono::steady_clock::now();
  std::vector<Tally> parts(threads);
  std::vector<std::thread> workers;
  for (std::size_t t = 0; t < threads; ++t) {
    workers.emplace_back([&, t] {
      for (std::uint64_t number = t; number < count; number += threads)
        fly_problem<true>(seed, number, flown, parts[t]);
    });
  }
  for (auto& worker : workers) worker.join();
  Tally all;
  for (const auto& part : parts) all.add(part);
  long wrong = 0;
  for (const bool single : {false, true}) {
    for (int form = 0; form < forms; ++form) {
      all.print(Form(form), single);
      if (Form(form) == Form::plain || Form(form) == Form::factored) all.print(Form(form), single, true);
      all.print_wrong(Form(form), single);
      if (all.total(Form(form), single).problems > 0) all.print_figures(Form(form), single);
      if (!single) wrong += all.total(Form(form), single).wrong();
    }
  }
  std::printf("\n%llu problems of seed %llu in %.0f s on %zu threads; wrong in double: %ld\n",
              static_cast<unsigned long long>(count), static_cast<unsigned long long>(seed),
              std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(), threads, wrong);
  return wrong > 0;
}
