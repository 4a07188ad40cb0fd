#include "qhull.hpp"

#include <libqhull_r/libqhull_r.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <unordered_map>

namespace vantage::test {
namespace {

// Where Qhull writes its messages; only their first line is of use.
class Messages {
 public:
  Messages() : file_(open_memstream(&text_, &size_)) {}
  ~Messages() {
    if (file_ != nullptr) std::fclose(file_);
    std::free(text_);
  }
  Messages(const Messages&) = delete;
  Messages& operator=(const Messages&) = delete;

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

class Run {
 public:
  explicit Run(std::FILE* messages) { qh_zero(&state_, messages); }
  ~Run() {
    qh_freeqhull(&state_, !qh_ALL);
    int long_blocks = 0, long_bytes = 0;
    qh_memfreeshort(&state_, &long_blocks, &long_bytes);
  }
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;

  [[nodiscard]] qhT* state() { return &state_; }

 private:
  qhT state_;
};

std::vector<RoughVertex> vertices_of(qhT* qh) {
  std::vector<RoughVertex> vertices;
  std::unordered_map<const vertexT*, std::size_t> place;
  for (const vertexT* v = qh->vertex_list; v != nullptr && v->next != nullptr; v = v->next) {
    place[v] = vertices.size();
    vertices.push_back(
        {static_cast<std::uint32_t>(qh_pointid(qh, v->point)), Point::Zero().eval()});
  }
  for (const facetT* f = qh->facet_list; f != nullptr && f->next != nullptr; f = f->next) {
    const Point normal(f->normal[0], f->normal[1], f->normal[2]);
    for (int k = 0; k < qh_setsize(qh, f->vertices); ++k) {
      vertices[place.at(static_cast<const vertexT*>(SETelem_(f->vertices, k)))].outward += normal;
    }
  }
  return vertices;
}

}  // namespace

Result<std::vector<RoughVertex>> qhull_vertices(std::span<const Point> points) {
  if (points.size() < 3) {
    return fail(ErrorCode::invalid_input, "too few points for a hull in space");
  }
  std::vector<double> coordinates;
  coordinates.reserve(3 * points.size() + 3);
  for (const Point& p : points) coordinates.insert(coordinates.end(), p.data(), p.data() + 3);
  coordinates.resize(coordinates.size() + 3, 0.0);

  const Messages messages;
  if (messages.file() == nullptr) return fail(ErrorCode::internal, "no memory for messages");
  const auto run = std::make_unique<Run>(messages.file());
  std::string command = "qhull Pp";
  const int exit_code =
      qh_new_qhull(run->state(), 3, static_cast<int>(points.size()) + 1, coordinates.data(), False,
                   command.data(), nullptr, messages.file());
  if (exit_code != qh_ERRnone) {
    return fail(exit_code == qh_ERRsingular ? ErrorCode::invalid_input : ErrorCode::internal,
                "Qhull: " + messages.first_line());
  }
  std::vector<RoughVertex> vertices = vertices_of(run->state());
  std::erase_if(vertices, [&](const RoughVertex& v) { return v.index == points.size(); });
  std::sort(vertices.begin(), vertices.end(),
            [](const auto& a, const auto& b) { return a.index < b.index; });
  return vertices;
}

}  // namespace vantage::test
