#include "convex_hull.hpp"

#include <libqhull_r/libqhull_r.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>
#include <string>

namespace vantage::hpr {
namespace {

// Catches what Qhull would print: its one way to say what went wrong.
class MessageStream {
 public:
  MessageStream() : file_(open_memstream(&text_, &size_)) {}
  ~MessageStream() {
    if (file_ != nullptr) std::fclose(file_);
    std::free(text_);
  }
  MessageStream(const MessageStream&) = delete;
  MessageStream& operator=(const MessageStream&) = delete;

  [[nodiscard]] std::FILE* file() const { return file_; }
  [[nodiscard]] std::string first_line() const {
    std::fflush(file_);
    const std::string all(text_, size_);
    return all.substr(0, all.find('\n'));
  }

 private:
  char* text_ = nullptr;
  std::size_t size_ = 0;
  std::FILE* file_;
};

// One run of Qhull; gives its memory back whatever happened.
class QhullRun {
 public:
  explicit QhullRun(std::FILE* messages) { qh_zero(&state_, messages); }
  ~QhullRun() {
    qh_freeqhull(&state_, !qh_ALL);
    int long_blocks = 0, long_bytes = 0;
    qh_memfreeshort(&state_, &long_blocks, &long_bytes);
  }
  QhullRun(const QhullRun&) = delete;
  QhullRun& operator=(const QhullRun&) = delete;

  [[nodiscard]] qhT* state() { return &state_; }

 private:
  qhT state_;
};

}  // namespace

Result<std::vector<std::uint32_t>> convex_hull_vertices(std::span<const double> coordinates,
                                                        int dimension) {
  const std::size_t size = coordinates.size() / static_cast<std::size_t>(dimension);
  if (size <= static_cast<std::size_t>(dimension)) {
    return fail(ErrorCode::invalid_input, "too few points for a convex hull");
  }
  if (size > static_cast<std::size_t>(std::numeric_limits<int>::max()) / 2) {
    return fail(ErrorCode::invalid_input, "too many points for Qhull");
  }
  const MessageStream messages;
  if (messages.file() == nullptr)
    return fail(ErrorCode::internal, "no memory for Qhull's messages");
  const auto run = std::make_unique<QhullRun>(messages.file());
  qhT* const qh = run->state();

  // Qhull takes non-const pointers but changes neither the command nor, without rotation or
  // scaling options, the points.
  std::string command = "qhull Pp";
  const int exit_code =
      qh_new_qhull(qh, dimension, static_cast<int>(size), const_cast<double*>(coordinates.data()),
                   False, command.data(), nullptr, messages.file());
  if (exit_code != qh_ERRnone) {
    return fail(exit_code == qh_ERRsingular ? ErrorCode::invalid_input : ErrorCode::internal,
                "convex hull: " + messages.first_line());
  }
  std::vector<std::uint32_t> vertices;
  vertices.reserve(static_cast<std::size_t>(qh->num_vertices));
  for (const vertexT* v = qh->vertex_list; v != nullptr && v->next != nullptr; v = v->next) {
    vertices.push_back(static_cast<std::uint32_t>(qh_pointid(qh, v->point)));
  }
  std::sort(vertices.begin(), vertices.end());
  return vertices;
}

}  // namespace vantage::hpr
