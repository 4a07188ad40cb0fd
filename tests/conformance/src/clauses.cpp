#include "clauses.hpp"

#include <utility>

namespace vantage::conformance {
namespace {

struct DoesNotApply {
  std::string why;
};

}  // namespace

void does_not_apply(std::string why) { throw DoesNotApply{std::move(why)}; }

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

std::string check(const Subject& subject, const Clause& clause) {
  SUBCASE(subcase_name(clause).c_str()) {
    INFO("random cases from seed " << subject.seed());
    try {
      clause.check(subject);
    } catch (const DoesNotApply& reason) {
      MESSAGE(clause.id << " does not apply: " << reason.why);
      return reason.why;
    }
  }
  return "";
}

void check(const Subject& subject) {
  for (const Clause& clause : clauses_of(subject.info().kind)) check(subject, clause);
}

}  // namespace vantage::conformance
