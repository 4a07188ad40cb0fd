#include "io/ros/transform_tree.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "io/ros/topic_choice.hpp"
#include "io/text.hpp"

namespace vantage::io::ros {

std::string_view frame_name(std::string_view frame_id) noexcept {
  if (frame_id.starts_with('/')) frame_id.remove_prefix(1);
  return frame_id;
}

bool TransformTree::add(std::string_view parent, std::string_view child) {
  constexpr std::size_t kMost = 10'000;
  std::vector<std::string>& parents = parents_[std::string(child)];
  if (std::find(parents.begin(), parents.end(), parent) != parents.end()) return true;
  if (edges_ == kMost) return false;
  parents.emplace_back(parent);
  ++edges_;
  return true;
}

TransformTree::Way TransformTree::up_from(const std::string& frame) const {
  Way way;
  way.frames = {frame};
  for (;;) {
    const auto found = parents_.find(way.frames.back());
    if (found == parents_.end()) return way;
    const std::vector<std::string>& parents = found->second;
    if (parents.size() > 1) {
      way.obstacle =
          fmt::format("frame {} has {} parents ({}), expected one",
                      quoted(std::string_view(found->first)), parents.size(), short_list(parents));
      return way;
    }
    if (way.frames.size() > edges_) {
      way.obstacle =
          fmt::format("frame {} is above itself", quoted(std::string_view(found->first)));
      return way;
    }
    way.frames.push_back(parents.front());
  }
}

Result<std::optional<TransformTree::Path>> TransformTree::path(const std::string& parent,
                                                               const std::string& child,
                                                               const std::string& file) const {
  const Way from_child = up_from(child), from_parent = up_from(parent);
  // The lowest frame above both.
  for (auto top = from_child.frames.begin(); top != from_child.frames.end(); ++top) {
    const auto met = std::find(from_parent.frames.begin(), from_parent.frames.end(), *top);
    if (met == from_parent.frames.end()) continue;
    Path path;  // p_parent = T_top_parent^-1 T_top_child p_child
    for (auto at = from_parent.frames.begin(); at != met; ++at) {
      path.push_back({.edge = {.parent = *(at + 1), .child = *at}, .is_inverse = true});
    }
    for (auto at = top; at != from_child.frames.begin(); --at) {
      path.push_back({.edge = {.parent = *at, .child = *(at - 1)}, .is_inverse = false});
    }
    return path;
  }
  for (const std::string& obstacle : {from_child.obstacle, from_parent.obstacle}) {
    if (!obstacle.empty()) {
      return fail(ErrorCode::corrupt_data, obstacle, SourceLocation{file, 0, 0});
    }
  }
  return std::nullopt;
}

std::string TransformTree::edges() const {
  std::vector<std::string> edges;
  for (const auto& [child, parents] : parents_) {
    for (const std::string& parent : parents) edges.push_back(parent + " -> " + child);
  }
  return short_list(edges);
}

}  // namespace vantage::io::ros
