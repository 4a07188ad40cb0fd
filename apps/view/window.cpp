#include "view/window.hpp"

#include <fmt/format.h>
#include <open3d/geometry/Image.h>
#include <open3d/geometry/PointCloud.h>
#include <open3d/geometry/TriangleMesh.h>
#include <open3d/utility/Logging.h>
#include <open3d/visualization/visualizer/RenderOption.h>
#include <open3d/visualization/visualizer/ViewControl.h>
#include <open3d/visualization/visualizer/VisualizerWithKeyCallback.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <numbers>

#include "vantage/kit/atomic_file.hpp"
#include "view/borders.hpp"
#include "view/camera.hpp"
#include "view/sites.hpp"

namespace vantage::view {
namespace {

namespace o3d = open3d;
using Mesh = o3d::geometry::TriangleMesh;

const Color kBackground(0.075, 0.082, 0.102);
const Color kBorder(0.80, 0.83, 0.88);
const Color kFaintBorder(0.34, 0.36, 0.40);  // elements are few, and their colours matter
const Color kChosenBorder(1.0, 1.0, 1.0);
const Color kViewpoint(1.0, 0.35, 0.25);
const Color kTrajectory(1.0, 0.62, 0.12);
const Color kWeak(1.0, 1.0, 1.0);
const Color kAlike(0.86, 0.60, 1.0);

constexpr const char* kAdvice =
    "run it under `xvfb-run -a` (a display that is not seen, enough for --png), or in a desktop "
    "session";

/// A line as a bar of square section, because OpenGL draws lines one pixel wide whatever width is
/// set.
void add_line(Mesh& mesh, const PointCloud& line, double radius, const Color& color) {
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const Eigen::Vector3d along = line[i + 1] - line[i];
    if (along.squaredNorm() == 0.0) continue;
    const bool upright = along.head<2>().norm() < 1e-6 * along.norm();
    const Eigen::Vector3d side =
        along.cross(upright ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitZ()).normalized();
    const Eigen::Vector3d up = side.cross(along).normalized();
    const int first = static_cast<int>(mesh.vertices_.size());
    // A radius longer at both ends, which closes the corners.
    const Eigen::Vector3d more = radius * along.normalized();
    for (const Eigen::Vector3d& end :
         {Eigen::Vector3d(line[i] - more), Eigen::Vector3d(line[i + 1] + more)}) {
      for (const auto& [s, u] : {std::pair(1, 1), {-1, 1}, {-1, -1}, {1, -1}}) {
        mesh.vertices_.push_back(end + radius * (s * side + u * up));
        mesh.vertex_colors_.push_back(color);
      }
    }
    for (int k = 0; k < 4; ++k) {
      const int a = first + k, b = first + (k + 1) % 4;
      mesh.triangles_.emplace_back(a, b, a + 4);
      mesh.triangles_.emplace_back(b, b + 4, a + 4);
    }
  }
}

void add_dot(Mesh& mesh, const Point& at, double radius, const Color& color) {
  const auto ball = Mesh::CreateSphere(radius, 8);
  const int first = static_cast<int>(mesh.vertices_.size());
  for (const auto& v : ball->vertices_) {
    mesh.vertices_.push_back(at + v);
    mesh.vertex_colors_.push_back(color);
  }
  for (const auto& t : ball->triangles_) {
    mesh.triangles_.push_back(t + Eigen::Vector3i::Constant(first));
  }
}

/// How wide a line must be in the drawing to look right: a share of the scene.
double line_radius(const Drawing& drawing) {
  const double extent = bounds_of(drawing.points).diagonal();
  return std::clamp(0.0007 * extent, 0.02, 1.0);
}

void add_borders(Mesh& mesh, const Show& show, const Drawing& drawing) {
  const MapIndex& index = show.scene.index();
  const Point& origin = show.scene.origin();
  const Terrain terrain(drawing.points);
  const double radius = line_radius(drawing);
  const bool elements = show.scene.contributions().has_value();
  for (std::uint32_t r = 0; r < index.partition.size(); ++r) {
    const bool chosen = show.controls.region == RegionId{r};
    // The points that one region sees say too little about the terrain below the other borders.
    if (show.controls.region && !chosen) continue;
    for (Segment segment : outline(index.partition[RegionId{r}].footprint)) {
      segment.a -= origin.head<2>();
      segment.b -= origin.head<2>();
      add_line(mesh, draped(segment, terrain, 3.0 * radius), (chosen ? 2.0 : 1.0) * radius,
               chosen ? kChosenBorder : (elements ? kFaintBorder : kBorder));
    }
  }
}

void add_sites(Mesh& mesh, const Show& show, double radius) {
  const double dot = 4.5 * radius;
  for (const SiteMark& mark :
       site_marks(*show.scene.atlas(), show.scene.origin(), show.controls.region, dot)) {
    add_dot(mesh, mark.at, 1.5 * dot, mark.color);
    add_line(mesh, mark.weak, radius, kWeak);
    for (const Point& place : mark.alike) {
      add_line(mesh, {mark.at, place}, 0.4 * radius, kAlike);
      add_dot(mesh, place, 0.6 * dot, kAlike);
    }
  }
}

std::shared_ptr<Mesh> lines_of(const Show& show, const Drawing& drawing) {
  auto mesh = std::make_shared<Mesh>();
  const double radius = line_radius(drawing);
  if (show.controls.borders && show.scene.bundle()) add_borders(*mesh, show, drawing);
  if (show.controls.viewpoints) {
    for (const Point& p : drawing.viewpoints) add_dot(*mesh, p, 3.0 * radius, kViewpoint);
  }
  const bool atlas = show.controls.coloring == Coloring::localizability;
  if (atlas && show.controls.sites && show.scene.atlas()) add_sites(*mesh, show, radius);
  if (show.controls.trajectory) add_line(*mesh, show.lines.trajectory, 1.4 * radius, kTrajectory);
  return mesh;
}

std::shared_ptr<o3d::geometry::PointCloud> points_of(const Drawing& drawing,
                                                     std::vector<Color> colors) {
  auto cloud = std::make_shared<o3d::geometry::PointCloud>();
  cloud->points_ = drawing.points;
  cloud->colors_ = std::move(colors);
  return cloud;
}

/// A size with which the points would cover the picture about twice if they were spread over it.
/// @param scale  how much larger than the picture it is drawn
int covering_point_size(const Drawing& drawing, const Size& size, int scale = 1) {
  constexpr double kLargest = 6.0;
  const double pixels = 2.0 * size.width * size.height;
  const double points = static_cast<double>(std::max<std::size_t>(drawing.points.size(), 1));
  // Elements stand apart, and each has a colour to see.
  const double largest = drawing.leverages.empty() ? kLargest : scale * kLargest;
  return static_cast<int>(std::clamp(std::round(std::sqrt(pixels / points)), 1.0, largest));
}

/// Open3D's visualizer with the drawing in it.
class Canvas {
 public:
  Canvas() = default;
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;
  ~Canvas() {
    if (open_) visualizer_.DestroyVisualizerWindow();
  }

  [[nodiscard]] Result<void> open(const std::string& title, const Size& size, bool visible) {
    VANTAGE_CHECK(check_display());
    // Open3D reports a window that it cannot open in its own lines on stdout.
    o3d::utility::SetVerbosityLevel(o3d::utility::VerbosityLevel::Error);
    if (!visualizer_.CreateVisualizerWindow(title, size.width, size.height, 50, 50, visible)) {
      return fail(
          ErrorCode::unsupported,
          std::string("no window can be opened on this display (it takes OpenGL 3.3): ") + kAdvice);
    }
    open_ = true;
    auto& options = visualizer_.GetRenderOption();
    options.background_color_ = kBackground;
    options.point_color_option_ = o3d::visualization::RenderOption::PointColorOption::Color;
    options.light_on_ = false;
    options.mesh_show_back_face_ = true;
    return {};
  }

  void show_points(const Drawing& drawing, std::vector<Color> colors) {
    auto points = points_of(drawing, std::move(colors));
    if (points_) visualizer_.RemoveGeometry(points_, false);
    visualizer_.AddGeometry(points, points_ == nullptr);
    points_ = std::move(points);
  }
  void show_lines(std::shared_ptr<Mesh> lines) {
    if (lines_) visualizer_.RemoveGeometry(lines_, false);
    lines_ = lines->vertices_.empty() ? nullptr : std::move(lines);
    if (lines_) visualizer_.AddGeometry(lines_, false);
  }
  void set_point_size(int pixels) { visualizer_.GetRenderOption().SetPointSize(pixels); }

  void fit(const Drawing& drawing) {
    auto& control = visualizer_.GetViewControl();
    // Narrower than Open3D's 60 degrees, so that walls stay upright and far things are large
    // enough.
    constexpr double kFieldOfView = 35.0, kStep = 5.0;  // [degrees]
    control.ChangeFieldOfView((kFieldOfView - control.GetFieldOfView()) / kStep);
    const double fov = control.GetFieldOfView() * std::numbers::pi / 180.0;
    const Camera camera =
        oblique_view(drawing.points, fov,
                     static_cast<double>(control.GetWindowWidth()) / control.GetWindowHeight());
    control.SetLookat(camera.lookat);
    control.SetFront(camera.front);
    control.SetUp(Eigen::Vector3d::UnitZ());
    control.SetZoom(camera.distance * std::tan(0.5 * fov) /
                    control.GetBoundingBox().GetMaxExtent());
  }

  /// Errors: `unsupported` for a size other than what was asked for.
  [[nodiscard]] Result<Picture> picture() {
    const auto image = visualizer_.CaptureScreenFloatBuffer(true);
    if (!image || image->IsEmpty() || image->num_of_channels_ != 3) {
      return fail(ErrorCode::unsupported, "the graphics of this display give no picture");
    }
    Picture picture{{image->width_, image->height_}, {}};
    const auto count = static_cast<std::size_t>(image->width_ * image->height_ * 3);
    picture.rgb.resize(count);
    const auto* values = reinterpret_cast<const float*>(image->data_.data());
    std::transform(values, values + count, picture.rgb.begin(), [](float value) {
      return static_cast<std::uint8_t>(std::lround(255.0F * std::clamp(value, 0.0F, 1.0F)));
    });
    return picture;
  }

  [[nodiscard]] o3d::visualization::VisualizerWithKeyCallback& visualizer() { return visualizer_; }

 private:
  o3d::visualization::VisualizerWithKeyCallback visualizer_;
  bool open_ = false;
  std::shared_ptr<o3d::geometry::PointCloud> points_;
  std::shared_ptr<Mesh> lines_;
};

/// vantage-view-1.png, or the first free number.
std::filesystem::path free_name() {
  std::filesystem::path path;
  int number = 1;
  do {
    path = fmt::format("vantage-view-{}.png", number++);
  } while (std::filesystem::exists(path));
  return path;
}

Result<std::filesystem::path> save(const Picture& picture) {
  const auto path = free_name();
  VANTAGE_TRY(const std::string png, to_png(picture));
  VANTAGE_CHECK(io::write_text_atomically(path, png));
  return path;
}

/// A window and what it shows; reacts to keys.
class Window {
 public:
  Window(Show& show, Drawing drawing) : show_(show), drawing_(std::move(drawing)) {}

  [[nodiscard]] Result<void> run() {
    VANTAGE_CHECK(canvas_.open("vantage view: " + show_.scene.name(), show_.size, true));
    if (show_.controls.point_size == 0) {
      show_.controls.point_size = covering_point_size(drawing_, show_.size);
    }
    canvas_.set_point_size(show_.controls.point_size);
    draw();
    canvas_.fit(drawing_);
    register_keys();
    canvas_.visualizer().Run();
    return {};
  }

 private:
  [[nodiscard]] Shown shown() const {
    const auto& bundle = show_.scene.bundle();
    return {bundle ? static_cast<std::uint32_t>(show_.scene.index().partition.size()) : 0,
            !show_.lines.trajectory.empty(), show_.scene.atlas().has_value(),
            show_.scene.contributions().has_value()};
  }

  void draw() {
    const Scales scales = scales_of(drawing_);
    canvas_.show_points(drawing_,
                        colors_of(drawing_, show_.controls.coloring, scales, show_.scene.hues()));
    canvas_.show_lines(lines_of(show_, drawing_));
    if (show_.tell) show_.tell(drawing_, show_.controls, scales);
  }

  /// Draws what the controls select; if it cannot be read, nothing changes.
  void change_points(const Controls& before) {
    const bool views = show_.controls.coloring == Coloring::views;
    auto drawing = show_.scene.draw(show_.controls.region, views, show_.progress);
    if (!drawing) {
      std::cerr << drawing.error() << '\n';
      const auto tried = show_.controls.region;
      show_.controls = before;
      // An empty map must not end the round.
      if (tried && tried != before.region) show_.controls.region = tried;
      return;
    }
    drawing_ = *std::move(drawing);
    draw();
  }

  /// @return whether to draw again
  bool answer(char key) {
    const Controls before = show_.controls;
    switch (press(key, show_.controls, shown())) {
      case Reaction::none: return false;
      case Reaction::points: change_points(before); return true;
      case Reaction::lines: canvas_.show_lines(lines_of(show_, drawing_)); return true;
      case Reaction::point_size: canvas_.set_point_size(show_.controls.point_size); return true;
      case Reaction::fit: canvas_.fit(drawing_); return true;
      case Reaction::help: std::cerr << key_help(shown()); return false;
      case Reaction::quit: canvas_.visualizer().Close(); return false;
      case Reaction::picture: {
        const auto saved = canvas_.picture().and_then(&save);
        if (saved) {
          std::cerr << "saved " << saved->string() << '\n';
        } else {
          std::cerr << saved.error() << '\n';
        }
        return false;
      }
    }
    return false;
  }

  void register_keys() {
    const auto on = [&](int code, char key) {
      canvas_.visualizer().RegisterKeyCallback(
          code, [this, key](o3d::visualization::Visualizer*) { return answer(key); });
    };
    // All letters, because Open3D's own reactions (writing files on P, D and O) are not wanted
    // here.
    for (char key = 'A'; key <= 'Z'; ++key) on(key, key);
    for (const int code : {GLFW_KEY_EQUAL, GLFW_KEY_KP_ADD}) on(code, '+');
    for (const int code : {GLFW_KEY_MINUS, GLFW_KEY_KP_SUBTRACT}) on(code, '-');
    on(GLFW_KEY_ESCAPE, 'Q');
  }

  Show& show_;
  Drawing drawing_;
  Canvas canvas_;
};

}  // namespace

Result<void> check_display() {
  for (const char* name : {"DISPLAY", "WAYLAND_DISPLAY"}) {
    const char* value = std::getenv(name);
    if (value != nullptr && *value != '\0') return {};
  }
  return fail(ErrorCode::unsupported, std::string("no display: ") + kAdvice);
}

Result<Picture> render(const Show& show, const Drawing& drawing) {
  // Drawn twice as large and scaled down, which smooths edges. OpenGL 3.3 guarantees only this many
  // pixels.
  constexpr int kLargest = 8192;
  const int factor = 2 * std::max(show.size.width, show.size.height) <= kLargest ? 2 : 1;
  const Size large{factor * show.size.width, factor * show.size.height};
  Canvas canvas;
  VANTAGE_CHECK(canvas.open("vantage view", large, false));
  const int chosen = show.controls.point_size;
  canvas.set_point_size(chosen > 0 ? factor * chosen : covering_point_size(drawing, large, factor));
  const Scales scales = scales_of(drawing);
  canvas.show_points(drawing,
                     colors_of(drawing, show.controls.coloring, scales, show.scene.hues()));
  canvas.show_lines(lines_of(show, drawing));
  canvas.fit(drawing);
  VANTAGE_TRY(const Picture picture, canvas.picture());
  if (picture.size != large) {
    return fail(ErrorCode::unsupported,
                fmt::format("this display draws {}x{} pixels instead of {}x{}: a smaller --size",
                            picture.size.width, picture.size.height, large.width, large.height));
  }
  return factor == 1 ? picture : scaled_down(picture, factor);
}

Result<void> run_window(Show& show, Drawing drawing) {
  return Window(show, std::move(drawing)).run();
}

}  // namespace vantage::view
