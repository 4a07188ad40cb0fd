#include "evaluate/page/error_classes.hpp"

#include <fmt/format.h>

namespace vantage::page {

std::size_t error_class_of(double cm) {
  std::size_t k = 0;
  while (k + 1 < kErrorClasses.size() && cm >= kErrorClasses[k].below_cm) ++k;
  return k;
}

std::string error_class_legend() {
  std::string html;
  for (std::size_t k = 0; k < kErrorClasses.size(); ++k) {
    html += fmt::format("<span><i class=\"dot e{}\"></i>{}</span> ", k, kErrorClasses[k].label);
  }
  return html;
}

}  // namespace vantage::page
