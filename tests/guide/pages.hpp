// SPDX-License-Identifier: BSD-3-Clause
// The pages of this repository against its programs: every block of code on a page is cut from a program that
// the suite runs (cut.hpp), and the tests, files, links, targets, presets and names that a page names are
// there.
#pragma once

#include "cut.hpp"

namespace pages {

/// A heading's anchor, as GitHub makes it: small letters, no punctuation, hyphens for spaces.
inline std::string anchor_of(const std::string& heading) {
  std::string out;
  for (const char c : trimmed(heading.substr(heading.find_first_not_of('#')))) {
    if (c == ' ' || c == '-')
      out += '-';
    else if (is_word(c) || static_cast<unsigned char>(c) >= 0x80)
      out += static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  }
  return out;
}

/// What pages are held to. Generated pages have the cells that their program writes.
struct Rules {
  Lines generated;
  Lines awaited;  // not written yet: may be linked to
  int readme_lines = 120, cell = 120;
};

class Checker {
 public:
  Checker(const Tree& tree, const Rules& rules) : tree_(tree), rules_(rules) {
    for (const auto& [path, text] : tree) {
      if (path.ends_with("CMakeLists.txt") || path.ends_with(".cmake")) cmake_ += text;
      if (path.starts_with("include/")) headers_ += text;
    }
  }

  /// All that is wrong: "page:line: what".
  Lines check() {
    for (const auto& [path, text] : tree_) {
      if (is_page(path)) check(path, lines_of(text));
    }
    const auto readme = tree_.find("README.md");
    const std::size_t length = readme == tree_.end() ? 0 : lines_of(readme->second).size();
    if (static_cast<int>(length) > rules_.readme_lines)
      complaints_.push_back("README.md:1: " + std::to_string(length) + " lines, more than " +
                            std::to_string(rules_.readme_lines));
    return complaints_;
  }

  static bool is_page(const std::string& path) {
    return path.ends_with(".md") && (path == "README.md" || path.starts_with("examples/guide/") ||
                                     path.starts_with("examples/write_your_own/"));
  }

 private:
  void complain(std::size_t line, const std::string& what) {
    complaints_.push_back(page_ + ":" + std::to_string(line + 1) + ": " + what);
  }

  bool exists(const std::string& path) const {
    if (tree_.contains(path)) return true;
    const auto below = tree_.lower_bound(path + "/");
    return below != tree_.end() && below->first.starts_with(path + "/");
  }

  void check(const std::string& path, const Lines& lines) {
    page_ = path;
    const bool generated =
        std::find(rules_.generated.begin(), rules_.generated.end(), path) != rules_.generated.end();
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const std::string t = trimmed(lines[i]);
      if (t.starts_with("```")) {
        std::size_t end = i + 1;
        while (end < lines.size() && trimmed(lines[end]) != "```") ++end;
        if (end == lines.size()) complain(i, "a fence that does not end");
        check_block(lines, i, end);
        i = end;
        continue;
      }
      if (t.starts_with("|") && !generated) {
        for (const std::string& cell : split(t, '|')) {
          if (characters(trimmed(cell)) > rules_.cell)
            complain(i, "a cell of " + std::to_string(characters(trimmed(cell))) +
                            " characters: " + cell.substr(0, 40));
        }
      }
      check_links(i, lines[i]);
      check_names(i, lines[i]);
      check_commands(i, lines[i]);
    }
  }

  void check_block(const Lines& lines, std::size_t from, std::size_t end) {
    const std::string language = trimmed(lines[from]).substr(3);
    const std::string before = from == 0 ? "" : lines[from - 1];
    const Lines block(lines.begin() + static_cast<std::ptrdiff_t>(from) + 1,
                      lines.begin() + static_cast<std::ptrdiff_t>(std::min(end, lines.size())));
    if (language == "sh") {
      for (std::size_t i = 0; i < block.size(); ++i) {
        check_commands(from + 1 + i, block[i]);
        check_names(from + 1 + i, block[i]);
      }
    } else if (language == "cpp" || language == "cmake" ||
               (language == "python" && !comment_of(before, "cut").empty())) {
      if (!comment_of(before, "not jml").empty()) {
        for (std::size_t i = 0; i < block.size(); ++i) {
          if (block[i].find("jml::") != block[i].npos || block[i].find("jml/") != block[i].npos)
            complain(from + 1 + i, "said to be code of another library, and is of jml");
        }
        return;
      }
      const std::string origin = comment_of(before, "cut");
      if (origin.empty()) return complain(from, "a block that is cut from no program");
      std::string complaint;
      const Lines parts = cut(tree_, origin, complaint);
      if (!complaint.empty()) return complain(from, complaint);
      for (std::size_t i = 0; i < std::max(parts.size(), block.size()); ++i) {
        if (i < parts.size() && i < block.size() && parts[i] == block[i]) continue;
        return complain(from + 1 + i, "differs from " + origin +
                                          ", which has there: " + (i < parts.size() ? parts[i] : "nothing") +
                                          " (the target `pages` mends it)");
      }
    } else if (language != "text" && language != "python" && language != "json") {
      complain(from, "a fence of the language '" + language + "': cpp, cmake, sh, python, json or text");
    }
  }

  void check_links(std::size_t line, const std::string& text) {
    for (std::size_t at = text.find("]("); at != text.npos; at = text.find("](", at + 1)) {
      const std::string link = text.substr(at + 2, text.find(')', at) - at - 2);
      if (link.find("://") != link.npos) continue;
      std::string path = link.substr(0, link.find('#')), folder = folder_of(page_);
      while (path.starts_with("../") && !folder.empty()) {
        path.erase(0, 3);
        folder = folder_of(folder.substr(0, folder.size() - 1));
      }
      path = path.empty() ? page_ : folder + path;
      if (path.ends_with('/')) path.pop_back();
      if (!exists(path)) {
        if (std::find(rules_.awaited.begin(), rules_.awaited.end(), path) == rules_.awaited.end())
          complain(line, "a link to nothing: " + link);
      } else if (const std::size_t hash = link.find('#'); hash != link.npos && path.ends_with(".md")) {
        const Lines there = lines_of(tree_.at(path));
        if (std::none_of(there.begin(), there.end(), [&](const std::string& l) {
              return l.starts_with("#") && anchor_of(l) == link.substr(hash + 1);
            }))
          complain(line, "no such heading: " + link);
      }
    }
  }

  /// Tests, examples, demos, paths and names of jml:: that a line names.
  void check_names(std::size_t line, const std::string& text) {
    for (std::size_t at = 0; at < text.size(); ++at) {
      if (!is_word(text[at]) || (at > 0 && (is_word(text[at - 1]) || text[at - 1] == '/' ||
                                            text.substr(at - std::min<std::size_t>(at, 2), 2) == "](")))
        continue;
      const std::string word = word_at(text, at), path = word_at(text, at, "/.*-");
      const bool of_the_tree = word == "tests" || word == "examples" || word == "include" || word == "data" ||
                               word == "cmake" || word == "bench";
      if (of_the_tree && path.size() > word.size() + 1 && path[word.size()] == '/' &&
          path.find('*') == path.npos) {
        std::string name = path;
        while (name.ends_with('.') || name.ends_with('/')) name.pop_back();
        if (!exists(name)) complain(line, "no such file: " + name);
      } else if (word.ends_with("_test") && !has_program("tests/", word) && !has_word(cmake_, word)) {
        complain(line, "no such test: " + word);
      } else if (word.starts_with("demo_") && !has_word(cmake_, word) &&
                 !has_program("examples/", without(word.substr(5), "_results"))) {
        complain(line, "no such demo: " + word);
      } else if (word.starts_with("example_") && !has_program("examples/", word.substr(8))) {
        complain(line, "no such example: " + word);
      } else if (word == "jml" && text.substr(at + 3, 2) == "::") {
        std::string last;
        for (const std::string& name : split(word_at(text, at, ":"), ':')) {
          if (!name.empty() && name != "jml") last = name;
        }
        if (!last.empty() && !has_word(headers_, last) && cmake_.find("jml::" + last) == cmake_.npos &&
            !has_word(cmake_, last))
          complain(line, "no such name: jml::" + last);
      }
    }
  }

  static std::string without(const std::string& name, const std::string& end) {
    return name.ends_with(end) ? name.substr(0, name.size() - end.size()) : name;
  }

  bool has_program(const std::string& folder, const std::string& stem) const {
    return std::any_of(tree_.begin(), tree_.end(), [&](const auto& file) {
      return file.first.starts_with(folder) && file.first.ends_with("/" + stem + ".cpp");
    });
  }

  /// Presets and targets.
  void check_commands(std::size_t line, const std::string& text) {
    const auto each = [&](const std::string& option, const auto& look) {
      for (std::size_t at = text.find(option + " "); at != text.npos; at = text.find(option + " ", at + 1)) {
        const std::string name = word_at(text, at + option.size() + 1);
        if (!name.empty()) look(name);
      }
    };
    each("--preset", [&](const std::string& name) {
      const auto presets = tree_.find("CMakePresets.json");
      const std::string all = presets == tree_.end() ? "" : presets->second;
      const std::size_t workflows = std::min(all.find("\"workflowPresets\""), all.size());
      const bool workflow = text.find("--workflow") != text.npos;
      if ((workflow ? all.substr(workflows) : all).find("\"name\": \"" + name + "\"") == all.npos)
        complain(line, "no such preset: " + name);
    });
    each("--target", [&](const std::string& name) {
      const bool of_a_list = name.starts_with("run_demo_") && has_word(cmake_, name.substr(9));
      const bool of_an_example = name.starts_with("example_") && has_word(cmake_, name.substr(8));
      if (!has_word(cmake_, name) && !of_a_list && !of_an_example) complain(line, "no such target: " + name);
    });
  }

  const Tree& tree_;
  Rules rules_;
  std::string cmake_, headers_, page_;
  Lines complaints_;
};

}  // namespace pages
