// SPDX-License-Identifier: BSD-3-Clause
// Do README and guide say what the stored results say?
//
//   quoted check ROOT     every number that is quoted, against examples/guide/results/*.csv; exit code 1
//                         where one differs
//   quoted write ROOT     puts the stored numbers in their places
//
// What is quoted stands in examples/guide/results/quoted.txt:
//
//   [README.md]                                    the page
//   position RMSE of {plaza1:ekf_rmse .2} m        a piece of it, with a stored result in place of the number
//   given: noise of 0.05 rad                       a piece whose numbers are no results: limits, settings
//   given by FILE: 3.34 ± 0.70                     a piece that must stand in that file too,
//   given by FILE after WORDS: 3.34 ± 0.70         behind these words
//   [examples/guide/measured.md whole]             a page where nothing may be left out, see below
//   [examples/guide/depth.md decimals]             the same, but for the rows of tables
//
// A piece is found by its words; how the page breaks its lines does not matter. It must be there once. A
// piece that begins with | is a whole row of a table. On a whole page every number with a decimal point and
// every row of a table that holds a digit must lie in a piece; code need not.
#include <algorithm>
#include <cctype>

#include "results.hpp"

namespace {

using guide::Results;

bool is_space(char c) { return c == ' ' || c == '\n' || c == '\t'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

/// Where the number that starts at `at` ends; `at` itself where none does. "12 345.6", "1.2e-13", "-3".
std::size_t end_of_number(const std::string& text, std::size_t at) {
  std::size_t end = at + (at < text.size() && text[at] == '-' ? 1 : 0);
  if (end >= text.size() || !is_digit(text[end])) return at;
  const auto digits = [&](std::size_t from) {
    while (from < text.size() && is_digit(text[from])) ++from;
    return from;
  };
  end = digits(end);
  while (end < text.size() && is_space(text[end]) && digits(end + 1) == end + 4 && end - at <= 12) end += 4;
  if (end + 1 < text.size() && text[end] == '.' && is_digit(text[end + 1])) end = digits(end + 1);
  if (end + 1 < text.size() && text[end] == 'e') {
    const std::size_t sign = end + 1 + (text[end + 1] == '-' ? 1 : 0);
    if (digits(sign) > sign) end = digits(sign);
  }
  return end;
}

struct Piece {
  std::string text;                // as the list has it, for messages
  std::vector<std::string> words;  // between the numbers; one more than
  std::vector<std::string> expressions;
};

Piece parsed(const std::string& line) {
  Piece piece{line, {}, {}};
  std::size_t at = 0;
  for (std::size_t open = line.find('{'); open != std::string::npos; open = line.find('{', open + 1)) {
    const std::size_t close = std::min(line.find('}', open), line.size() - 1);
    const std::string inside = line.substr(open + 1, close - open - 1);
    if (inside.find(' ') == std::string::npos || inside.find('{') != std::string::npos)
      continue;  // `Factored{Ekf{}}`
    piece.words.push_back(line.substr(at, open - at));
    piece.expressions.push_back(inside);
    at = close + 1;
  }
  piece.words.push_back(line.substr(at));
  return piece;
}

struct Place {
  std::size_t begin, end;
  std::vector<std::pair<std::size_t, std::size_t>> numbers;
};

/// The end of `words` in `text` from `at`, any white space being like any other.
std::size_t after_words(const std::string& text, std::size_t at, const std::string& words) {
  for (std::size_t i = 0; i < words.size();) {
    if (is_space(words[i])) {
      if (at >= text.size() || !is_space(text[at])) return std::string::npos;
      while (i < words.size() && is_space(words[i])) ++i;
      while (at < text.size() && is_space(text[at])) ++at;
    } else if (at >= text.size() || text[at++] != words[i++]) {
      return std::string::npos;
    }
  }
  return at;
}

std::vector<Place> places(const std::string& text, const Piece& piece) {
  std::vector<Place> out;
  for (std::size_t begin = 0; begin < text.size(); ++begin) {
    // not from the middle of a number or a word
    if (begin > 0 && is_word(text[begin]) && (is_word(text[begin - 1]) || text[begin - 1] == '.')) continue;
    Place place{begin, begin, {}};
    for (std::size_t i = 0; i < piece.words.size() && place.end != std::string::npos; ++i) {
      place.end = after_words(text, place.end, piece.words[i]);
      if (place.end == std::string::npos || i == piece.expressions.size()) break;
      const std::size_t end = end_of_number(text, place.end);
      if (end == place.end)
        place.end = std::string::npos;
      else
        place.numbers.emplace_back(place.end, end);
      if (place.end != std::string::npos) place.end = end;
    }
    if (place.end == std::string::npos || place.end == begin) continue;
    if (piece.words.front().starts_with("|")) {  // a row of a table: all of it
      if (begin > 0 && text[begin - 1] != '\n') continue;
      if (place.end < text.size() && text[place.end] != '\n') continue;
    }
    out.push_back(std::move(place));
  }
  return out;
}

class Page {
 public:
  enum class Asked { quotes, decimals, whole };
  Page(std::filesystem::path file, std::string name, Asked asked)
      : file_(std::move(file)), name_(std::move(name)), asked_(asked), text_(guide::contents(file_)) {
    if (text_.empty()) complain("cannot be read");
  }
  bool good() const { return good_; }

  void quote(const std::string& line, const Results& results, const std::filesystem::path& root) {
    const bool elsewhere = line.starts_with("given by "), given = elsewhere || line.starts_with("given: ");
    const std::size_t colon = given ? line.find(": ") : std::string::npos;
    const Piece piece = parsed(given && colon != std::string::npos ? line.substr(colon + 2) : line);
    if (elsewhere && !stands_elsewhere(line.substr(9, colon - 9), piece.words.front(), root))
      return complain("quotes what is not there: " + line);
    if (given != piece.expressions.empty())
      return complain("in the list, neither a result nor given: " + line);
    auto found = places(text_, piece);
    if (found.size() != 1 && !given)
      return complain((found.empty() ? "does not say: " : "says more than once: ") + line);
    if (found.empty()) return complain("does not say: " + line);
    for (std::size_t i = 0; i < piece.expressions.size(); ++i) {
      std::string why;
      const auto value = guide::evaluated(piece.expressions[i], results, why);
      if (!value) {
        complain(why + ", in: " + line);
        continue;
      }
      const auto [begin, end] = found.front().numbers[i];
      const std::string said = text_.substr(begin, end - begin);
      if (said != *value) changes_.push_back({begin, end, *value, piece.expressions[i]});
    }
    for (const Place& place : found) covered_.emplace_back(place.begin, place.end);
  }

  void check() {
    for (const Change& c : changes_)
      complain("says " + text_.substr(c.begin, c.end - c.begin) + ", the stored result is " + c.value + ": " +
               c.expression);
    if (asked_ != Asked::quotes) look_for_more();
  }

  void write() {
    std::sort(changes_.begin(), changes_.end(),
              [](const Change& a, const Change& b) { return a.begin > b.begin; });
    for (const Change& c : changes_) {
      std::printf("%s: %s becomes %s: %s\n", name_.c_str(), text_.substr(c.begin, c.end - c.begin).c_str(),
                  c.value.c_str(), c.expression.c_str());
      text_.replace(c.begin, c.end - c.begin, c.value);
    }
    if (!changes_.empty() && !(std::ofstream(file_) << text_)) complain("cannot be written");
  }

 private:
  struct Change {
    std::size_t begin, end;
    std::string value, expression;
  };

  void complain(const std::string& what) {
    std::printf("%s %s\n", name_.c_str(), what.c_str());
    good_ = false;
  }
  bool is_covered(std::size_t begin, std::size_t end) const {
    return std::any_of(covered_.begin(), covered_.end(),
                       [=](const auto& c) { return c.first <= begin && end <= c.second; });
  }

  /// FILE, or FILE after WORDS: are these words there?
  static bool stands_elsewhere(const std::string& where, const std::string& words,
                               const std::filesystem::path& root) {
    const std::size_t after = where.find(" after ");
    const std::string before = after == std::string::npos ? "" : where.substr(after + 7);
    return !places(guide::contents(root / where.substr(0, after)), {"", {before + words}, {}}).empty();
  }

  /// Numbers and rows of tables that no piece holds.
  void look_for_more() {
    std::size_t at = 0, row = 0;  // of a table: its heading, the line below it, then its body
    bool fenced = false;
    std::istringstream lines(text_);
    for (std::string line; std::getline(lines, line); at += line.size() + 1) {
      if (line.starts_with("```")) fenced = !fenced;
      if (fenced) continue;
      row = line.starts_with("|") ? row + 1 : 0;
      const bool has_digit = std::any_of(line.begin(), line.end(), is_digit);
      if (asked_ == Asked::whole && row > 2 && has_digit && !is_covered(at, at + line.size()))
        complain("has a row that is no stored result: " + line);
      if (asked_ == Asked::whole && row > 0) continue;
      bool code = false;
      for (std::size_t i = 0; i < line.size(); ++i) {
        if (line[i] == '`') code = !code;
        if (code || !is_digit(line[i]) || (i > 0 && (is_word(line[i - 1]) || line[i - 1] == '.'))) continue;
        const std::size_t end = end_of_number(line, i);
        if (line.substr(i, end - i).find('.') != std::string::npos && !is_covered(at + i, at + end))
          complain("has a number that is no stored result: " + line.substr(i, end - i) + ", in: " + line);
        i = std::max(i, end - 1);
      }
    }
  }

  std::filesystem::path file_;
  std::string name_;
  Asked asked_;
  bool good_ = true;
  std::string text_;
  std::vector<Change> changes_;
  std::vector<std::pair<std::size_t, std::size_t>> covered_;
};

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc == 3 ? argv[1] : "";
  if (what != "check" && what != "write")
    return std::fputs("quoted check|write ROOT (see the source)\n", stderr), 2;
  const std::filesystem::path root = argv[2], directory = root / "examples/guide/results";
  const Results results(directory);
  std::istringstream list(guide::contents(directory / "quoted.txt"));
  bool good = true;
  int pages = 0, pieces = 0;
  std::optional<Page> page;
  const auto finish = [&] {
    if (!page) return;
    what == "check" ? page->check() : page->write();
    good = good && page->good();
  };
  for (std::string line; std::getline(list, line);) {
    if (line.empty() || line[0] == '#') continue;
    if (line[0] == '[') {
      finish();
      const Page::Asked asked = line.ends_with(" whole]")      ? Page::Asked::whole
                                : line.ends_with(" decimals]") ? Page::Asked::decimals
                                                               : Page::Asked::quotes;
      const std::string name = line.substr(1, line.find_first_of(" ]") - 1);
      page.emplace(root / name, name, asked);
      ++pages;
    } else if (page) {
      page->quote(line, results, root);
      ++pieces;
    }
  }
  finish();
  std::printf("%d pieces of %d pages\n", pieces, pages);
  return good && pieces > 0 ? 0 : 1;
}
