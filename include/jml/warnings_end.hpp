// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Last line of each header of jml: warnings are the project's again. See warnings_begin.hpp.
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif
