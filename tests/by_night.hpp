// SPDX-License-Identifier: BSD-3-Clause
// Whether the tests run at full size, as the preset nightly has them.
#pragma once

#include <cstdlib>

inline bool by_night() { return std::getenv("JML_NIGHTLY") != nullptr; }
