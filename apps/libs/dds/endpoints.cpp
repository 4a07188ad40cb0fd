#include "dds/endpoints.hpp"

#include <algorithm>

#include "dds/names.hpp"

namespace vantage::dds {

Misfit Endpoints::other_type(const Mine& mine, const Other& other) {
  return {.topic = mine.shown,
          .is_read = other.meets.second,
          .own_type = type_of_name(mine.type),
          .other_type = type_of_name(other.type)};
}

Misfit Endpoints::other_policy(const Own& own, const Mine& mine, const std::string& policy) {
  return {.topic = mine.shown, .is_read = own.second, .policy = policy};
}

void Endpoints::tell(const std::vector<Misfit>& found) const {
  if (!sink_) return;
  for (const Misfit& one : found) sink_(one);
}

void Endpoints::add(const Own& own, const std::string& shown, const std::string& type) {
  std::vector<Misfit> found;
  {
    const std::scoped_lock lock(mutex_);
    const Mine& mine = mine_.emplace(own, Mine{shown, type, {}}).first->second;
    for (const auto& [guid, other] : others_) {
      if (other.meets == own && other.type != mine.type) found.push_back(other_type(mine, other));
    }
  }
  tell(found);
}

void Endpoints::find(const Guid& guid, const std::string& topic, const std::string& type,
                     bool is_writer) {
  std::vector<Misfit> found;
  {
    const std::scoped_lock lock(mutex_);
    const auto [other, is_new] =
        others_.emplace(guid, Other{.meets = {topic, is_writer}, .type = type});
    const auto mine = mine_.find({topic, is_writer});
    if (is_new && mine != mine_.end() && mine->second.type != type) {
      found.push_back(other_type(mine->second, other->second));
    }
  }
  tell(found);
}

void Endpoints::lose(const Guid& guid) {
  const std::scoped_lock lock(mutex_);
  others_.erase(guid);
}

void Endpoints::match(const Guid& guid) {
  const std::scoped_lock lock(mutex_);
  const auto other = others_.find(guid);
  if (other == others_.end()) return;  // it went while DDS was matching it
  other->second.policies.clear();
  other->second.is_matched = true;
}

void Endpoints::unmatch(const Guid& guid) {
  const std::scoped_lock lock(mutex_);
  const auto other = others_.find(guid);
  if (other != others_.end()) other->second.is_matched = false;
}

void Endpoints::refuse(const Own& own, const std::map<std::string, std::uint32_t>& counts) {
  std::vector<Misfit> found;
  {
    const std::scoped_lock lock(mutex_);
    const auto mine = mine_.find(own);
    if (mine == mine_.end()) return;
    std::set<std::string> policies;
    for (const auto& [policy, count] : counts) {
      std::uint32_t& before = mine->second.counts[policy];
      if (count <= before) continue;
      before = count;
      policies.insert(policy);
      found.push_back(other_policy(own, mine->second, policy));
    }
    // DDS does not say whose they are: those of the endpoints that nothing is known of.
    for (auto& [guid, other] : others_) {
      if (other.meets != own || other.type != mine->second.type) continue;
      if (other.policies.empty() && !other.is_matched) other.policies = policies;
    }
  }
  tell(found);
}

std::vector<Misfit> Endpoints::misfits() const {
  const std::scoped_lock lock(mutex_);
  std::vector<Misfit> found;
  const auto add = [&](Misfit one) {
    if (std::ranges::find(found, one) == found.end()) found.push_back(std::move(one));
  };
  for (const auto& [guid, other] : others_) {
    const auto mine = mine_.find(other.meets);
    if (mine == mine_.end() || other.is_matched) continue;
    if (other.type != mine->second.type) {
      add(other_type(mine->second, other));
      continue;
    }
    for (const std::string& policy : other.policies) {
      add(other_policy(other.meets, mine->second, policy));
    }
  }
  return found;
}

}  // namespace vantage::dds
