// SPDX-License-Identifier: BSD-3-Clause
// rewrite_pages <root>: writes the blocks of every page anew from the programs they are cut from.
#include <cstdio>

#include "tree.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const std::filesystem::path root = argv[1];
  const pages::Tree tree = pages::read_tree(root);
  for (const auto& [path, text] : tree) {
    if (!pages::Checker::is_page(path)) continue;
    const std::string anew = pages::recut(tree, path);
    if (anew == text) continue;
    std::ofstream(root / path, std::ios::binary) << anew;
    std::printf("rewritten: %s\n", path.c_str());
  }
  return 0;
}
