#include "bundle/content_config.hpp"

namespace vantage {

Config content_config(const Config& config) {
  Config content = config;
  if (!config.store ||
      config.store->content.value_or(StoredContent::points) == StoredContent::points) {
    content.matcher.reset();
  }
  content.store.reset();
  content.localizer.reset();
  content.live.reset();
  content.atlas.reset();
  content.relocalizer = config.relocalizer_in_use();
  content.viewpoints = config.viewpoints.value_or(ViewpointParams{});
  if (content.viewpoints->source == ViewpointSource::trajectory) content.ground.reset();
  return content;
}

}  // namespace vantage
