#pragma once

/// Marks what libvantage_core exports; everything else in it is hidden.
#define VANTAGE_API __attribute__((visibility("default")))
