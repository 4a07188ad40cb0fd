#pragma once

/// Marks what a shared library of Vantage exports; everything else in it is hidden.
#define VANTAGE_API __attribute__((visibility("default")))
