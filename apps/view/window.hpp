#pragma once

#include <functional>
#include <vector>

#include "vantage/result.hpp"
#include "view/controls.hpp"
#include "view/picture.hpp"
#include "view/scene.hpp"

namespace vantage::view {

/// Lines over the map that do not belong to the points.
struct Lines {
  PointCloud trajectory;  ///< around the scene's origin [m]
};

/// Errors: `unsupported` with what to do where there is no display to open a window on.
[[nodiscard]] Result<void> check_display();

/// What is drawn from, and what is told to the person in front of it.
struct Show {
  Scene& scene;
  Lines lines;
  Controls controls;
  Size size;
  Bundle::Progress progress;  ///< for maps that are read later
  std::function<void(const Drawing&, const Controls&, const Scales&)> tell;  ///< what is drawn now
};

/// Draws without a window on the screen. Errors: as check_display; `unsupported` without OpenGL 3.3
/// or for a picture that the graphics cannot make.
[[nodiscard]] Result<Picture> render(const Show& show, const Drawing& drawing);

/// Opens a window and stays until it is closed. Errors: as `render`.
[[nodiscard]] Result<void> run_window(Show& show, Drawing drawing);

}  // namespace vantage::view
