// SPDX-License-Identifier: BSD-3-Clause
#include <jml/jml.hpp>
