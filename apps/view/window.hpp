#pragma once

#include <functional>
#include <vector>

#include "vantage/result.hpp"
#include "view/controls.hpp"
#include "view/picture.hpp"
#include "view/scene.hpp"

namespace vantage::view {

/// Lines over the map that do not come from its points.
struct Lines {
  PointCloud trajectory;  ///< around the scene's origin [m]
};

/// Errors: `unsupported`, with what to do, if there is no display for a window.
[[nodiscard]] Result<void> check_display();

/// What is drawn, and what is reported to the person who looks at it.
struct Show {
  Scene& scene;
  Lines lines;
  Controls controls;
  Size size;
  Bundle::Progress progress;  ///< for maps that are read later
  std::function<void(const Drawing&, const Controls&, const Scales&)> tell;  ///< what is drawn now
};

/// Draws without a window on the screen. Errors: as check_display; `unsupported` without OpenGL 3.3
/// or for a picture that the graphics hardware cannot make.
[[nodiscard]] Result<Picture> render(const Show& show, const Drawing& drawing);

/// Opens a window and returns when it is closed. Errors: as `render`.
[[nodiscard]] Result<void> run_window(Show& show, Drawing drawing);

}  // namespace vantage::view
