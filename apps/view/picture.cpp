#include "view/picture.hpp"

#include <png.h>

#include <charconv>

namespace vantage::view {

std::optional<Size> parse_size(std::string_view text) {
  constexpr int kSmallest = 64, kLargest = 8192;
  const char* const end = text.data() + text.size();
  Size size;
  const auto [x, bad_width] = std::from_chars(text.data(), end, size.width);
  if (bad_width != std::errc{} || x == end || *x != 'x') return std::nullopt;
  const auto [stop, bad_height] = std::from_chars(x + 1, end, size.height);
  if (bad_height != std::errc{} || stop != end) return std::nullopt;
  for (const int side : {size.width, size.height}) {
    if (side < kSmallest || side > kLargest) return std::nullopt;
  }
  return size;
}

Picture scaled_down(const Picture& picture, int factor) {
  Picture small{{picture.size.width / factor, picture.size.height / factor}, {}};
  const auto at = [&](int x, int y, int channel) {
    const auto row = static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.size.width);
    return picture.rgb[(row + static_cast<std::size_t>(x)) * 3 + static_cast<std::size_t>(channel)];
  };
  small.rgb.reserve(static_cast<std::size_t>(small.size.width * small.size.height) * 3);
  const unsigned area = static_cast<unsigned>(factor * factor);
  for (int y = 0; y < small.size.height; ++y) {
    for (int x = 0; x < small.size.width; ++x) {
      for (int channel = 0; channel < 3; ++channel) {
        unsigned sum = 0;
        for (int i = 0; i < factor * factor; ++i) {
          sum += at(factor * x + i % factor, factor * y + i / factor, channel);
        }
        small.rgb.push_back(static_cast<std::uint8_t>((sum + area / 2) / area));
      }
    }
  }
  return small;
}

Result<std::string> to_png(const Picture& picture) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.size.width);
  image.height = static_cast<png_uint_32>(picture.size.height);
  image.format = PNG_FORMAT_RGB;
  std::string content;
  png_alloc_size_t bytes = PNG_IMAGE_PNG_SIZE_MAX(image);
  content.resize(bytes);
  if (png_image_write_to_memory(&image, content.data(), &bytes, 0, picture.rgb.data(), 0,
                                nullptr) == 0) {
    return fail(ErrorCode::internal, std::string("the picture cannot be encoded: ") +
                                         static_cast<const char*>(image.message));
  }
  content.resize(bytes);
  return content;
}

}  // namespace vantage::view
