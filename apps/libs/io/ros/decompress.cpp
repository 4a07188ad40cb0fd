#include "io/ros/decompress.hpp"

#include <bzlib.h>
#include <fmt/format.h>
#include <lz4frame.h>
#include <zstd.h>

#include <new>

namespace vantage::io::ros {
namespace {

struct Progress {
  std::size_t taken = 0, given = 0;  // [bytes]
  bool ended = false;                // a stream or frame is complete
  bool damaged = false;
};

class Bz2Stream {
 public:
  static constexpr std::string_view kName = "bz2";
  static constexpr bool kMayFollow = false;

  Bz2Stream() noexcept { ready_ = BZ2_bzDecompressInit(&stream_, 0, 0) == BZ_OK; }
  ~Bz2Stream() {
    if (ready_) BZ2_bzDecompressEnd(&stream_);
  }
  Bz2Stream(const Bz2Stream&) = delete;
  Bz2Stream& operator=(const Bz2Stream&) = delete;

  [[nodiscard]] bool ready() const noexcept { return ready_; }
  [[nodiscard]] Progress go_on(std::string_view input, std::span<char> output) noexcept {
    stream_.next_in = const_cast<char*>(input.data());  // NOLINT: bzlib only reads it
    stream_.avail_in = static_cast<unsigned>(input.size());
    stream_.next_out = output.data();
    stream_.avail_out = static_cast<unsigned>(output.size());
    const int status = BZ2_bzDecompress(&stream_);
    return {input.size() - stream_.avail_in, output.size() - stream_.avail_out,
            status == BZ_STREAM_END, status != BZ_OK && status != BZ_STREAM_END};
  }

 private:
  bz_stream stream_{};
  bool ready_ = false;
};

class Lz4Stream {
 public:
  static constexpr std::string_view kName = "LZ4";
  static constexpr bool kMayFollow = true;

  Lz4Stream() noexcept {
    if (LZ4F_isError(LZ4F_createDecompressionContext(&context_, LZ4F_VERSION))) context_ = nullptr;
  }
  ~Lz4Stream() { LZ4F_freeDecompressionContext(context_); }
  Lz4Stream(const Lz4Stream&) = delete;
  Lz4Stream& operator=(const Lz4Stream&) = delete;

  [[nodiscard]] bool ready() const noexcept { return context_ != nullptr; }
  [[nodiscard]] Progress go_on(std::string_view input, std::span<char> output) noexcept {
    std::size_t taken = input.size(), given = output.size();
    const std::size_t hint =
        LZ4F_decompress(context_, output.data(), &given, input.data(), &taken, nullptr);
    if (LZ4F_isError(hint)) return {.damaged = true};
    return {taken, given, hint == 0, false};
  }

 private:
  LZ4F_dctx* context_ = nullptr;
};

class ZstdStream {
 public:
  static constexpr std::string_view kName = "zstd";
  static constexpr bool kMayFollow = true;

  ZstdStream() noexcept : context_(ZSTD_createDCtx()) {}
  ~ZstdStream() { ZSTD_freeDCtx(context_); }
  ZstdStream(const ZstdStream&) = delete;
  ZstdStream& operator=(const ZstdStream&) = delete;

  [[nodiscard]] bool ready() const noexcept { return context_ != nullptr; }
  [[nodiscard]] Progress go_on(std::string_view input, std::span<char> output) noexcept {
    ZSTD_inBuffer in{input.data(), input.size(), 0};
    ZSTD_outBuffer out{output.data(), output.size(), 0};
    const std::size_t hint = ZSTD_decompressStream(context_, &out, &in);
    return {in.pos, out.pos, hint == 0, ZSTD_isError(hint) != 0};
  }

 private:
  ZSTD_DCtx* context_;
};

template <class Stream>
Decompressed run(std::string_view input, std::uint64_t largest, Buffer& output) {
  // A stated size is trusted at once only if ordinary data could compress that well.
  constexpr std::uint64_t kCommonExpansion = 8, kFirst = 65536;
  const auto room = static_cast<std::size_t>(std::min(largest, largest_content(input.size())) + 1);
  Decompressed done;
  const auto problem = [&done](std::string text) {
    done.problem = std::move(text);
    return done;
  };
  Stream stream;
  if (!stream.ready()) return problem("not enough memory to decompress");
  std::size_t at = 0;
  bool ended = false;
  for (;;) {
    if (done.size >= output.capacity() || output.capacity() == 0) {
      const std::uint64_t wanted =
          done.size == 0 ? std::max(kFirst, kCommonExpansion * input.size()) : 2 * done.size;
      if (!output.make_room(static_cast<std::size_t>(std::min<std::uint64_t>(wanted, room)),
                            done.size)) {
        return problem("not enough memory to decompress");
      }
    }
    const std::size_t end = std::min(output.capacity(), room);
    const Progress step = stream.go_on(input.substr(at), output.span(end).subspan(done.size));
    if (step.damaged) {
      return problem(fmt::format("the {} stream is damaged near its byte {}", Stream::kName, at));
    }
    at += step.taken;
    done.size += step.given;
    if (done.size == room) {
      --done.size;
      return problem(fmt::format("the {} stream of {} bytes gives more than {} bytes",
                                 Stream::kName, input.size(), room - 1));
    }
    // A frame that began after the last one has taken some input and has not ended.
    ended = step.ended || (ended && step.taken == 0 && step.given == 0);
    if (ended && at == input.size()) return done;
    if (ended && !Stream::kMayFollow) {
      return problem(fmt::format("the {} stream ends at its byte {}, expected {}", Stream::kName,
                                 at, input.size()));
    }
    if (step.taken == 0 && step.given == 0 && done.size < end) {
      return problem(fmt::format("the {} stream is cut off after its byte {}", Stream::kName, at));
    }
  }
}

}  // namespace

bool Buffer::make_room(std::size_t size, std::size_t kept) {
  if (size <= capacity_) return true;
  try {
    auto larger = std::make_unique_for_overwrite<char[]>(size);
    std::copy_n(bytes_.get(), kept, larger.get());
    bytes_ = std::move(larger);
  } catch (const std::bad_alloc&) {
    return false;
  }
  capacity_ = size;
  return true;
}

Decompressed decompress(Compression compression, std::string_view input, std::uint64_t largest,
                        Buffer& output) {
  switch (compression) {
    case Compression::bz2: return run<Bz2Stream>(input, largest, output);
    case Compression::lz4: return run<Lz4Stream>(input, largest, output);
    case Compression::zstd: return run<ZstdStream>(input, largest, output);
    case Compression::none: break;
  }
  return {.size = 0, .problem = "not compressed"};
}

}  // namespace vantage::io::ros
