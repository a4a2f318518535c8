// SPDX-License-Identifier: BSD-3-Clause
// Figures: one or more panels over each other, drawn to SVG by gnuplot through a pipe.
#pragma once

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

namespace demo {

// Told apart by the common kinds of colour blindness as well (Okabe and Ito).
namespace colour {
inline constexpr const char *black = "#000000", *blue = "#0072B2", *red = "#D55E00", *green = "#009E73",
                            *purple = "#CC79A7", *orange = "#E69F00", *sky = "#56B4E9", *grey = "#999999";
}

struct Series {
  std::string label, colour;
  std::vector<double> x, y;
  std::string style = "lines lw 1.6";  ///< in gnuplot's words
  std::vector<double> upper = {};      ///< a band from y to here, below what follows; empty: a line
};

/// A translucent band between two curves, for what lies within an interval of confidence.
inline Series band(std::string label, std::string colour, std::vector<double> x, std::vector<double> lower,
                   std::vector<double> upper) {
  return {std::move(label),
          std::move(colour),
          std::move(x),
          std::move(lower),
          "filledcurves fs transparent solid 0.18 noborder",
          std::move(upper)};
}

struct Panel {
  std::string y_title;
  std::vector<Series> series;
  std::string options = "";  ///< further gnuplot commands
};

struct Figure {
  std::string title, x_title;
  std::vector<Panel> panels;
  int width = 900, height = 520;

  /// The picture, and beside it its title and caption as text, for the index page. The caption says which
  /// figure of which source it redraws, and of which filter. False where gnuplot is missing or failed; the
  /// reason is printed once.
  bool write(const std::filesystem::path& file, const std::string& caption) const {
    std::ofstream words(std::filesystem::path(file).replace_extension("txt"));
    words << title << '\n' << caption << '\n';
    words.close();
    static const bool present = std::system("command -v gnuplot >/dev/null 2>&1") == 0;
    static bool told = false;
    if (!present) {
      if (!std::exchange(told, true)) {
        std::fprintf(stderr,
                     "gnuplot was not found, so no figures are drawn: install the package gnuplot-nox\n");
      }
      return false;
    }
    std::FILE* pipe = popen("gnuplot", "w");
    if (pipe == nullptr) return false;
    draw(pipe, file.string());
    const bool drawn = pclose(pipe) == 0;
    if (!drawn) std::fprintf(stderr, "gnuplot could not draw %s\n", file.c_str());
    return drawn;
  }

 private:
  void draw(std::FILE* out, const std::string& file) const {
    std::fprintf(out, "set terminal svg size %d,%d font 'Helvetica,15' background '#ffffff'\n", width,
                 height);
    std::fprintf(out, "set output '%s'\nset encoding utf8\n", file.c_str());
    for (std::size_t p = 0; p < panels.size(); ++p) {
      for (std::size_t s = 0; s < panels[p].series.size(); ++s) {
        const Series& series = panels[p].series[s];
        std::fprintf(out, "$d%zu_%zu << EOD\n", p, s);
        for (std::size_t i = 0; i < series.x.size(); ++i) {
          if (!std::isfinite(series.y[i]))
            std::fprintf(out, "\n");
          else if (series.upper.empty())
            std::fprintf(out, "%.7g %.7g\n", series.x[i], series.y[i]);
          else
            std::fprintf(out, "%.7g %.7g %.7g\n", series.x[i], series.y[i], series.upper[i]);
        }
        std::fprintf(out, "EOD\n");
      }
    }
    std::fprintf(out, "set grid lc rgb '#dddddd' lt 1 lw 0.7\nset border lw 0.8\nset tics scale 0.6\n");
    std::fprintf(out, "set lmargin 11\nset rmargin 3\n");
    const int count = static_cast<int>(panels.size());
    std::fprintf(out, "set multiplot layout %d,1 title \"%s\"\n", count, title.c_str());
    for (std::size_t p = 0; p < panels.size(); ++p) {
      std::fprintf(out, "set autoscale\nunset logscale\nset format '%% h'\n");  // nothing of the panel before
      std::fprintf(out,
                   "set key on above horizontal right nobox maxrows auto samplen 2.5 spacing 1.1 height 0\n");
      std::fprintf(out, "set xlabel '%s'\nset ylabel \"%s\"\n", p + 1 == panels.size() ? x_title.c_str() : "",
                   panels[p].y_title.c_str());
      std::fprintf(out, "%s\nplot ", panels[p].options.c_str());
      for (std::size_t s = 0; s < panels[p].series.size(); ++s) {
        const Series& series = panels[p].series[s];
        std::fprintf(out, "%s$d%zu_%zu using %s with %s lc rgb '%s' %s", s == 0 ? "" : ", ", p, s,
                     series.upper.empty() ? "1:2" : "1:2:3", series.style.c_str(), series.colour.c_str(),
                     series.label.empty() ? "notitle" : "title ");
        if (!series.label.empty()) std::fprintf(out, "\"%s\"", series.label.c_str());
      }
      std::fprintf(out, "\n");
    }
    std::fprintf(out, "unset multiplot\n");
  }
};

/// Every k-th value, so that no curve has more than about `points`.
inline std::vector<double> thinned(const std::vector<double>& values, std::size_t points = 1500) {
  const std::size_t k = values.size() / points + 1;
  std::vector<double> out;
  for (std::size_t i = 0; i < values.size(); i += k) out.push_back(values[i]);
  return out;
}

}  // namespace demo
