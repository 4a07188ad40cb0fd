#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "vantage/point_cloud.hpp"

/// Answers that are lists of indices, in the form in which the clauses compare them.
namespace vantage::conformance {

/// For each point, whether an answer names it.
using Labels = std::vector<std::uint8_t>;

/// Indices out of range do not count, and the order does not matter: one clause alone checks both.
[[nodiscard]] Labels labels_of(const IndexList& indices, std::size_t points);
/// The labels of `points` from those of in_order(points, order).
[[nodiscard]] Labels labels_before(const Labels& labels, const IndexList& order);
/// How many labels differ. Precondition: both have the same size.
[[nodiscard]] std::size_t differing(const Labels& a, const Labels& b);
[[nodiscard]] std::size_t count(const Labels& labels);

/// Fails unless the indices ascend strictly and are below `points`.
void check_ascending(const IndexList& indices, std::size_t points);

/// Clouds without a volume: one point, two points far apart, equal points, a line, a column.
[[nodiscard]] std::vector<PointCloud> degenerate_clouds();

/// The places in a cloud of n points where a clause puts a bad point.
[[nodiscard]] std::vector<std::size_t> some_places(std::size_t n);

}  // namespace vantage::conformance
