// SPDX-License-Identifier: BSD-3-Clause
// The pages are as the programs are; and every way in which they could not be is found, on a small made-up
// repository.
#include <gtest/gtest.h>

#include "guide/tree.hpp"

namespace {

TEST(Pages, AreAsTheProgramsAre) {
  const pages::Tree tree = pages::read_tree(JML_SOURCE_DIR);
  ASSERT_GT(tree.size(), 500U);
  const pages::Rules rules{.generated = {"examples/guide/claims.md"}, .awaited = {}};
  for (const std::string& complaint : pages::Checker(tree, rules).check()) ADD_FAILURE() << complaint;
  for (const auto& [path, text] : tree) {
    if (!pages::Checker::is_page(path)) continue;
    EXPECT_EQ(pages::recut(tree, path), text) << path;
  }
}

const std::string page = R"(# A page
See [the other](examples/guide/other.md#two-words), [a folder](examples/guide) and `jml::Filter`, held by `walk_test`;
tests/filter/walk_test.cpp, `demo_plane`, `example_walk`; `cmake --build --preset default --target plane`.

| a | b |
|---|---|
| 1 | 2 |

<!-- cut: examples/walk.cpp#model+use -->
```cpp
struct Walk {
  int states = 1;
};

run(Walk{});
```
<!-- not jml: others 1.0 -->
```cpp
other::run();
```
<!-- cut: examples/theirs.py#run -->
```python
run(1)
```
```sh
cmake --workflow --preset demo
```
)";

pages::Tree small_tree() {
  return {{"README.md", page},
          {"CMakePresets.json", R"("name": "default" "workflowPresets": "name": "demo")"},
          {"examples/CMakeLists.txt", "jml_example(walk)\nadd_executable(plane)\n"},
          {"examples/walk.cpp",
           "// [model]\nstruct Walk {\n  // [inner]\n  int states = 1;\n  // [/inner]\n};\n// [/model]\n"
           "int main() {\n  // [use]\n  run(Walk{});\n  // [/use]\n}\n"},
          {"examples/never_run.cpp", "// [model]\nstruct Walk {\n  int states = 1;\n};\n// [/model]\n"},
          {"examples/theirs.py", "# [run]\nrun(1)\n# [/run]\n"},
          {"examples/plane/plane.cpp", ""},
          {"examples/demo/plane.cpp", ""},
          {"examples/guide/other.md", "# Other\n## Two words\n"},
          {"include/jml/filter.hpp", "class Filter"},
          {"tests/filter/walk_test.cpp", ""}};
}

std::string complaints_about(const pages::Tree& tree) {
  std::string out;
  for (const std::string& line :
       pages::Checker(tree, {.generated = {}, .awaited = {}, .readme_lines = 36, .cell = 20}).check())
    out += line + "\n";
  return out;
}

/// The complaints when `what` of a file stands as `instead`.
std::string with(const std::string& file, const std::string& what, const std::string& instead) {
  pages::Tree tree = small_tree();
  std::string& text = tree.at(file);
  const std::size_t at = text.find(what);
  EXPECT_NE(at, text.npos) << what;
  text.replace(at, what.size(), instead);
  return complaints_about(tree);
}

TEST(Pages, OfASmallTreeAreRight) { EXPECT_EQ(complaints_about(small_tree()), ""); }

TEST(Pages, EveryFaultIsFound) {
  struct Fault {
    const char *file, *what, *instead, *complaint;
  };
  for (const Fault& f : {
           Fault{"README.md", "states = 1", "states = 2", "README.md:12: differs from"},
           {"README.md", "  int states", " int states", "README.md:12: differs from"},
           {"README.md", "run(Walk{});\n", "run(Walk{});\nmore();\n", "which has there: nothing"},
           {"README.md", "\nrun(Walk{});\n", "", "which has there: "},
           {"examples/walk.cpp", "run(Walk{});", "run(Walk{}, 1);", "README.md:15: differs from"},
           {"examples/walk.cpp", "// [/use]", "", "has no one part [use]"},
           {"examples/walk.cpp", "// [use]", "// [use]\n// [use]", "has no one part [use]"},
           {"README.md", "#model+use", "#model+used", "has no one part [used]"},
           {"README.md", "cut: examples/walk.cpp", "cut: examples/run.cpp", "no such program"},
           {"README.md", "walk.cpp#model+use", "never_run.cpp#model", "is not run by the suite"},
           {"README.md", "<!-- cut: examples/walk.cpp#model+use -->", "",
            "a block that is cut from no program"},
           {"README.md", "other::run", "jml::run", "is of jml"},
           {"README.md", "run(1)", "run(2)", "differs from examples/theirs.py#run"},
           {"README.md", "```sh", "```c++", "a fence of the language 'c++'"},
           {"README.md", "--preset demo\n```", "--preset demo", "a fence that does not end"},
           {"README.md", "--preset demo", "--preset demos", "no such preset: demos"},
           {"README.md", "--workflow --preset demo", "--workflow --preset default",
            "no such preset: default"},
           {"README.md", "--target plane", "--target planes", "no such target: planes"},
           {"README.md", "other.md#two", "another.md#two", "a link to nothing"},
           {"README.md", "#two-words", "#three-words", "no such heading"},
           {"README.md", "`walk_test`", "`run_test`", "no such test: run_test"},
           {"README.md", "tests/filter/", "tests/filters/", "no such file: tests/filters/walk_test.cpp"},
           {"README.md", "`demo_plane`", "`demo_plain`", "no such demo: demo_plain"},
           {"README.md", "example_walk", "example_run", "no such example: example_run"},
           {"README.md", "jml::Filter", "jml::Filters", "no such name: jml::Filters"},
           {"README.md", "| 2 |", "| twenty-one letters ab |", "a cell of 21 characters"},
           {"README.md", "# A page", "# A page\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n", "lines, more than 36"},
       }) {
    const std::string found = with(f.file, f.what, f.instead);
    EXPECT_NE(found.find(f.complaint), found.npos) << f.what << " -> " << f.instead << " gives\n" << found;
  }
  EXPECT_EQ(with("README.md", "| 2 |", "| ä of twenty letters! |"), "")
      << "a letter is one, however many its bytes";
}

TEST(Pages, AreCutAnew) {
  pages::Tree tree = small_tree();
  std::string& text = tree.at("README.md");
  text.replace(text.find("int states = 1"), 14, "int states = 7;\n  int more");
  EXPECT_EQ(pages::recut(tree, "README.md"), page);
  tree.at("examples/walk.cpp") = "nothing";  // what cannot be cut stays as it is
  EXPECT_EQ(pages::recut(tree, "README.md"), text);
}

}  // namespace
