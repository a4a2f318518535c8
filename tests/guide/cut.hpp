// SPDX-License-Identifier: BSD-3-Clause
// How the blocks of the pages are cut from programs.
//
// In the page, before the fence:    <!-- cut: examples/first_filter.cpp#model+use -->
// In the program, around a part:    // [model]  ...  // [/model]      (in CMake: # [model] ... # [/model])
//
// A block is its parts, one after the other with an empty line between, less the indentation they share. Code
// of another library, which no program here runs, says <!-- not jml: name --> instead, and may not say jml::
// or jml/. A script in Python, of another library too, is compared where it is here, though the suite does
// not run it.
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace pages {

using Tree = std::map<std::string, std::string>;  // path from the root of the repository: content
using Lines = std::vector<std::string>;

inline Lines lines_of(std::string_view text) {
  Lines out;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    out.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return out;
}

inline std::string trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  return first == text.npos ? ""
                            : std::string(text.substr(first, text.find_last_not_of(" \t\r") + 1 - first));
}

inline Lines split(std::string_view text, char at) {
  Lines out(1);
  for (const char c : text) {
    if (c == at)
      out.emplace_back();
    else
      out.back() += c;
  }
  return out;
}

inline bool is_word(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

/// The longest run of word characters, and of those in `more`, from `at` on.
inline std::string word_at(std::string_view text, std::size_t at, std::string_view more = "") {
  std::size_t end = at;
  while (end < text.size() && (is_word(text[end]) || more.find(text[end]) != more.npos)) ++end;
  return std::string(text.substr(at, end - at));
}

inline bool has_word(std::string_view text, std::string_view word) {
  for (std::size_t at = text.find(word); at != text.npos; at = text.find(word, at + 1)) {
    const bool starts = at == 0 || !is_word(text[at - 1]);
    const std::size_t end = at + word.size();
    if (starts && (end == text.size() || !is_word(text[end]))) return true;
  }
  return false;
}

inline int characters(std::string_view utf8) {
  return static_cast<int>(std::count_if(
      utf8.begin(), utf8.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }));
}

inline std::string folder_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  return slash == path.npos ? "" : path.substr(0, slash + 1);
}

/// The names of parts that a line of a program begins or ends: "[x]" or "[/x]"; empty: neither.
inline std::string mark_of(const std::string& line) {
  std::string t = trimmed(line);
  if (t.starts_with("// "))
    t.erase(0, 3);
  else if (t.starts_with("# "))
    t.erase(0, 2);
  else
    return "";
  if (t.size() < 3 || t.front() != '[' || t.back() != ']') return "";
  const std::size_t from = t[1] == '/' ? 2 : 1;
  return word_at(t, from).size() + from + 1 == t.size() ? t.substr(1, t.size() - 2) : "";
}

/// One part of a program; complaint: why there is none.
inline Lines part_of(const std::string& program, const std::string& name, std::string& complaint) {
  Lines out;
  int opened = 0, closed = 0;
  for (const std::string& line : lines_of(program)) {
    const std::string mark = mark_of(line);
    if (mark == name) ++opened;
    if (mark == "/" + name) ++closed;
    if (mark.empty() && opened == 1 && closed == 0 && line.find("clang-format o") == line.npos)
      out.push_back(line);
  }
  if (opened != 1 || closed != 1) complaint = "has no one part [" + name + "] … [/" + name + "]";
  while (!out.empty() && trimmed(out.back()).empty()) out.pop_back();
  while (!out.empty() && trimmed(out.front()).empty()) out.erase(out.begin());
  std::size_t indentation = 1000;
  for (const std::string& line : out) {
    if (!trimmed(line).empty()) indentation = std::min(indentation, line.find_first_not_of(' '));
  }
  for (std::string& line : out) line.erase(0, std::min(indentation, line.size()));
  return out;
}

/// What the suite runs of the tree: programs that a CMakeLists.txt names, and headers that such a program
/// includes.
inline bool is_run(const Tree& tree, const std::string& path, int depth = 3) {
  const std::string name = path.substr(folder_of(path).size());
  if (name == "CMakeLists.txt") return true;
  const std::string stem = name.substr(0, name.find('.'));
  for (std::string folder = folder_of(path); name.ends_with(".cpp");
       folder = folder_of(folder.substr(0, folder.size() - 1))) {
    const auto list = tree.find(folder + "CMakeLists.txt");
    if (list != tree.end() && has_word(list->second, stem)) return true;
    if (folder.empty()) return false;
  }
  if (depth == 0) return false;
  for (const auto& [from, text] : tree) {
    if (from.ends_with("CMakeLists.txt") && text.find("/" + path + ")") != text.npos) return true;
  }
  return std::any_of(tree.begin(), tree.end(), [&](const auto& file) {
    const auto& [from, text] = file;
    return from != path && (from.starts_with("examples/") || from.starts_with("tests/")) &&
           (from.ends_with(".cpp") || from.ends_with(".hpp")) &&
           (text.find("/" + name + "\"\n") != text.npos || text.find("\"" + name + "\"\n") != text.npos) &&
           is_run(tree, from, depth - 1);
  });
}

/// The block that "path#part+part" asks for.
inline Lines cut(const Tree& tree, const std::string& origin, std::string& complaint) {
  const std::size_t hash = origin.find('#');
  const std::string path = origin.substr(0, hash);
  const auto program = tree.find(path);
  if (hash == origin.npos || program == tree.end()) {
    complaint = "no such program: " + origin;
    return {};
  }
  if (!path.ends_with(".py") && !is_run(tree, path)) complaint = path + " is not run by the suite";
  Lines out;
  for (const std::string& name : split(origin.substr(hash + 1), '+')) {
    std::string why;
    const Lines part = part_of(program->second, name, why);
    if (!why.empty()) complaint = path + " " + why;
    if (!out.empty()) out.emplace_back();
    out.insert(out.end(), part.begin(), part.end());
  }
  return out;
}

/// "<!-- key: value -->" gives the value.
inline std::string comment_of(const std::string& line, const std::string& key) {
  const std::string t = trimmed(line), start = "<!-- " + key + ": ";
  return t.starts_with(start) && t.ends_with(" -->") ? t.substr(start.size(), t.size() - start.size() - 4)
                                                     : "";
}

/// The page as it should be: each block as its programs have it.
inline std::string recut(const Tree& tree, const std::string& path) {
  std::string out, origin;
  bool inside = false, replaced = false;
  for (const std::string& line : lines_of(tree.at(path))) {
    const bool fence = trimmed(line).starts_with("```");
    if (fence && !inside && !origin.empty()) {
      std::string complaint;
      const Lines block = cut(tree, origin, complaint);
      replaced = complaint.empty();
      out += line + "\n";
      for (const std::string& l : block) out += replaced ? l + "\n" : "";
      inside = true;
      continue;
    }
    if (fence) {
      inside = !inside;
      replaced = replaced && inside;
    }
    if (!inside || !replaced) out += line + "\n";
    origin = comment_of(line, "cut");
  }
  return out;
}

}  // namespace pages
