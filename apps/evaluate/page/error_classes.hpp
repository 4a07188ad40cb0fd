#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <string>

namespace vantage::page {

struct ErrorClass {
  double below_cm;
  const char* label;
};
/// Ordered from good to bad: the page's colours --e0 to --e4.
inline constexpr std::array kErrorClasses{
    ErrorClass{2.0, "below 2 cm"}, ErrorClass{5.0, "2 to 5 cm"}, ErrorClass{10.0, "5 to 10 cm"},
    ErrorClass{50.0, "10 to 50 cm"},
    ErrorClass{std::numeric_limits<double>::infinity(), "50 cm and more"}};
[[nodiscard]] std::size_t error_class_of(double cm);
/// A dot with its label for each class, as HTML.
[[nodiscard]] std::string error_class_legend();

}  // namespace vantage::page
