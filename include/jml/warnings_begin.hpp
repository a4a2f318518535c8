// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// First in each header of jml, with warnings_end.hpp last: warnings that a project may ask of its own code
/// and that are meant here. Indices are int, as Eigen's; numbers are compared exactly where exactly zero is asked;
/// what a step fills anyway is not set before. All others hold: tests/headers.
// No #pragma once: each header begins and ends its own part.
#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wfloat-equal"
#pragma GCC diagnostic ignored "-Weffc++"
#endif
