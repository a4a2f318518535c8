// SPDX-License-Identifier: BSD-3-Clause
// write_data DIRECTORY: the data files that every contender reads, one a contest, from the models of
// tests/models.
#include <cstdio>
#include <filesystem>
#include <jml/campaign/noise.hpp>
#include <navigation/trajectory.hpp>
#include <string>

#include "../cases.hpp"

void write_intervals(const std::filesystem::path& directory);  // interval/write_interval_data.cpp

namespace {

class File {
 public:
  File(const std::filesystem::path& directory, const std::string& name)
      : file_(std::fopen((directory / (name + ".csv")).c_str(), "w")) {}
  ~File() { std::fclose(file_); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  /// By rows.
  template <typename Derived>
  void row(const char* name, const Eigen::MatrixBase<Derived>& values) {
    std::fputs(name, file_);
    for (int i = 0; i < values.rows(); ++i) {
      for (int j = 0; j < values.cols(); ++j) std::fprintf(file_, ",%.17g", values(i, j));
    }
    std::fputc('\n', file_);
  }
  void row(const char* name, double value) { std::fprintf(file_, "%s,%.17g\n", name, value); }

 private:
  std::FILE* file_;
};

template <typename Case>
void write_steps(File& file, const Case& c) {
  jml::Matrix<double, Case::n, Case::n> noise;
  if (!cases::process_noise(c, noise)) std::abort();
  file.row("x0", c.start.x);
  file.row("P0", c.start.P);
  file.row("Q", noise);
  file.row("R", c.sensor.noise_covariance());
  for (const auto& y : c.y) file.row("y", y);
}

/// The flight of examples/strapdown_navigation.cpp, a fix after every tenth sample.
void write_strapdown(File& file) {
  using namespace navigation;
  jml::Noise random(1);
  const Strapdown unit;
  const Path path(Liveliness{}, random);
  const double dt = 0.01;
  const int every = 10;
  const jml::Vector<double, 6> biases{0.003, -0.002, 0.004, 0.05, 0.02, -0.04};
  const Flight flight = fly(unit, path, biases, dt, 6000, random);
  jml::Vector<double, degrees> sigma;
  sigma << 0.02, 0.02, 0.1, 1, 1, 1, 0.1, 0.1, 0.1, 0.005, 0.005, 0.005, 0.05, 0.05, 0.05;
  jml::Vector<double, degrees> off = sigma.cwiseProduct(random.normal_vector<degrees>());
  off.tail<6>() = biases;
  const GnssFix gnss{{0.5, 0, -1}};
  file.row("dt", dt);
  file.row("every", every);
  file.row("arm", gnss.place.arm);
  file.row("gravity", unit.gravity);
  file.row("grade", jml::Vector<double, 4>(unit.grade.gyro_noise, unit.grade.force_noise,
                                           unit.grade.gyro_walk, unit.grade.force_walk));
  file.row("gnss_sigma", jml::Vector<double, 4>(gnss.place.horizontal, gnss.place.vertical,
                                                gnss.speed.horizontal, gnss.speed.vertical));
  file.row("x0", Space::plus(flight.truth.front(), jml::Vector<double, degrees>(-off)));
  file.row("P0_diagonal", sigma.cwiseAbs2());
  for (int k = 1; k <= flight.steps(); ++k) {
    const auto now = static_cast<std::size_t>(k);
    file.row("imu", flight.inertial[now - 1]);
    if (k % every != 0) continue;
    file.row("gnss", measure(gnss, flight, k, random));
    file.row("truth", flight.truth[now]);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const std::filesystem::path directory = argv[1];
  std::filesystem::create_directories(directory);
  {
    const auto c = cases::make_n2();
    File file(directory, "n2");
    file.row("dt", c.dynamics.dt);
    file.row("c", c.dynamics.c);
    file.row("k", c.dynamics.k);
    write_steps(file, c);
  }
  {
    const auto c = cases::make_n6();
    File file(directory, "n6");
    file.row("dt", c.dynamics.dt);
    file.row("drag", c.dynamics.drag);
    file.row("gravity", c.dynamics.gravity);
    write_steps(file, c);
  }
  {
    const auto c = cases::make_n15();
    File file(directory, "n15");
    file.row("A", c.dynamics.A);
    file.row("H", c.sensor.H);
    file.row("bend_dynamics", c.dynamics.bend);
    file.row("bend_sensor", c.sensor.bend);
    write_steps(file, c);
  }
  File strapdown(directory, "strapdown");
  write_strapdown(strapdown);
  write_intervals(directory);
}
