#include "clauses.hpp"

namespace vantage::conformance {
std::vector<Clause> clauses_of(PluginKind kind) {
  const auto common = common_clauses();
  const auto own = with_kind(
      kind, []<class Interface>(const Kind<Interface>&) { return own_clauses<Interface>(); });
  std::vector<Clause> all(common.begin(), common.end());
  all.insert(all.end(), own.begin(), own.end());
  return all;
}

std::string subcase_name(const Clause& clause) {
  return std::string(clause.id) + ": " + std::string(clause.text);
}

void check(const Subject& subject, const Clause& clause) {
  SUBCASE(subcase_name(clause).c_str()) {
    INFO("random cases from seed " << subject.seed());
    const std::string exemption = clause.exemption ? clause.exemption(subject) : "";
    if (exemption.empty()) {
      clause.check(subject);
    } else {
      MESSAGE(clause.id << " does not apply: " << exemption);
    }
  }
}

void check(const Subject& subject) {
  for (const Clause& clause : clauses_of(subject.info().kind)) check(subject, clause);
}

}  // namespace vantage::conformance
