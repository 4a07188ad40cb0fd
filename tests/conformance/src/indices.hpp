#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "vantage/point_cloud.hpp"

/// Answers that are lists of indices, as the clauses compare them.
namespace vantage::conformance {

/// Of each point whether an answer names it.
using Labels = std::vector<std::uint8_t>;

/// Indices that are out of range do not count, nor does the order: one clause alone judges those.
[[nodiscard]] Labels labels_of(const IndexList& indices, std::size_t points);
/// The labels of `points` from those of in_order(points, order).
[[nodiscard]] Labels labels_before(const Labels& labels, const IndexList& order);
/// How many points are labelled differently. Precondition: as many labels.
[[nodiscard]] std::size_t differing(const Labels& a, const Labels& b);
[[nodiscard]] std::size_t count(const Labels& labels);

/// Fails unless the indices ascend strictly and are below `points`.
void check_ascending(const IndexList& indices, std::size_t points);

/// Clouds without a volume: one point, two far apart, equal ones, a line, a column.
[[nodiscard]] std::vector<PointCloud> degenerate_clouds();

/// Every place in a cloud of n points where a clause puts a bad one.
[[nodiscard]] std::vector<std::size_t> some_places(std::size_t n);

}  // namespace vantage::conformance
