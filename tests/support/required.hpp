#pragma once

#include <stdexcept>
#include <utility>

#include "vantage/error.hpp"
#include "vantage/result.hpp"

namespace vantage::test {

/// The value of a result without which a test or benchmark cannot go on.
/// Throws std::runtime_error with the error's text.
template <class T>
T required(Result<T> result) {
  if (!result) throw std::runtime_error(to_string(result.error()));
  return *std::move(result);
}

}  // namespace vantage::test
