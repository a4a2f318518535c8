# SPDX-License-Identifier: BSD-3-Clause
"""Ratios of times that were taken in the same rounds."""
import statistics


def quartiles(of, other):
    """Median and quartiles of of / other in the same rounds."""
    each = sorted(a / b for a, b in zip(of, other))
    if len(each) < 2:
        return each * 3
    low, middle, high = statistics.quantiles(each, n=4, method="inclusive")
    return [middle, low, high]
