#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "vantage/result.hpp"

namespace vantage::io::ros {

/// A frame's name without the leading slash that tf of ROS 1 used.
[[nodiscard]] std::string_view frame_name(std::string_view frame_id) noexcept;

/// Which frames have transforms between them: each from a child to its only parent.
class TransformTree {
 public:
  struct Edge {
    std::string parent, child;
    friend auto operator<=>(const Edge&, const Edge&) = default;
  };
  /// T_parent_child of an edge, or its inverse.
  struct Step {
    Edge edge;
    bool is_inverse = false;
  };
  using Path = std::vector<Step>;

  /// @return whether there is room for it: a bag has a few hundred frames at most
  [[nodiscard]] bool add(std::string_view parent, std::string_view child);

  /// The steps whose product is T_parent_child; nothing if the frames are not connected.
  /// Errors: `corrupt_data` if they are not connected and a frame on the way has several parents or
  /// is above itself.
  [[nodiscard]] Result<std::optional<Path>> path(const std::string& parent,
                                                 const std::string& child,
                                                 const std::string& file) const;

  /// "map -> odom, odom -> base_link and 3 more"
  [[nodiscard]] std::string edges() const;

 private:
  struct Way {
    std::vector<std::string> frames;  // from the first one up
    std::string obstacle;             // why the path ends here; empty at the top of the tree
  };
  [[nodiscard]] Way up_from(const std::string& frame) const;

  std::map<std::string, std::vector<std::string>> parents_;  // of each child
  std::size_t edges_ = 0;
};

}  // namespace vantage::io::ros
