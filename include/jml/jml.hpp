// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Everything of jml that needs Eigen alone: no heap, no exceptions, no RTTI.
#pragma once

#include <jml/filter/iterated.hpp>
#include <jml/filter/filter.hpp>
