#include "clauses.hpp"

namespace vantage::conformance {

std::span<const Clause> visibility_clauses() { return {}; }

}  // namespace vantage::conformance
