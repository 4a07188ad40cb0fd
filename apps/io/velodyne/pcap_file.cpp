#include "io/velodyne/pcap_file.hpp"

#include <fmt/format.h>
#include <pcap/pcap.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

namespace vantage::io::velodyne {

struct PcapFile::State {
  explicit State(InputFile input) : file(std::move(input)) {}
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() { close(); }

  void close() noexcept {
    if (reader != nullptr) pcap_close(reader);  // closes the stream
    reader = nullptr;
  }
  [[nodiscard]] Result<void> open();
  [[nodiscard]] tl::unexpected<Error> error(const char* message) const;
  // Reads like read(2), through a buffer: libpcap asks for few bytes at a time.
  [[nodiscard]] ssize_t read(char* bytes, std::size_t size) noexcept;

  InputFile file;
  pcap_t* reader = nullptr;
  std::size_t position = 0;      // what libpcap has read [bytes]
  std::vector<char> buffer;      // a part of the file ...
  std::size_t buffer_start = 0;  // ... from here on
  std::optional<Error> failure;  // of reading the file, which libpcap cannot hand on
};

namespace {

constexpr std::size_t kBufferSize = std::size_t{1} << 18U;

std::string_view without_line_ends(std::string_view text) noexcept {
  return text.substr(0, text.find_first_of("\r\n"));
}

}  // namespace

ssize_t PcapFile::State::read(char* bytes, std::size_t size) noexcept try {
  size = std::min(size, file.size() - position);
  std::size_t done = 0;
  while (done < size) {
    if (position < buffer_start || position >= buffer_start + buffer.size()) {
      buffer.resize(std::min(kBufferSize, file.size() - position));
      buffer_start = position;
      if (auto filled = file.read(position, buffer); !filled) {
        buffer.clear();
        failure = std::move(filled).error();
        errno = EIO;
        return -1;
      }
    }
    const std::size_t at = position - buffer_start;
    const std::size_t count = std::min(size - done, buffer.size() - at);
    std::copy_n(buffer.data() + at, count, bytes + done);
    done += count;
    position += count;
  }
  return static_cast<ssize_t>(done);
} catch (const std::exception&) {
  errno = ENOMEM;
  return -1;
}

tl::unexpected<Error> PcapFile::State::error(const char* message) const {
  if (failure) return fail(*failure);
  return fail(ErrorCode::corrupt_data,
              fmt::format("the capture cannot be read on at byte {} of {}: {:.200}", position,
                          file.size(), without_line_ends(message)),
              SourceLocation{file.name(), 0, 0});
}

Result<void> PcapFile::State::open() {
  close();
  position = 0;
  failure.reset();
  cookie_io_functions_t functions{};
  functions.read = [](void* state, char* bytes, std::size_t size) {
    return static_cast<State*>(state)->read(bytes, size);
  };
  std::FILE* const stream = ::fopencookie(this, "r", functions);
  if (stream == nullptr) {
    return fail(ErrorCode::io_failure,
                fmt::format("cannot be opened as a stream ({})", system_message(errno)),
                SourceLocation{file.name(), 0, 0});
  }
  // Not buffered twice; and so `position` is that of libpcap.
  std::setvbuf(stream, nullptr, _IONBF, 0);
  std::array<char, PCAP_ERRBUF_SIZE> message{};
  reader =
      pcap_fopen_offline_with_tstamp_precision(stream, PCAP_TSTAMP_PRECISION_NANO, message.data());
  if (reader != nullptr) return {};
  std::fclose(stream);
  return error(message.data());
}

PcapFile::PcapFile(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
PcapFile::PcapFile(PcapFile&&) noexcept = default;
PcapFile& PcapFile::operator=(PcapFile&&) noexcept = default;
PcapFile::~PcapFile() = default;

Result<PcapFile> PcapFile::open(InputFile file) {
  PcapFile opened(std::make_unique<State>(std::move(file)));
  VANTAGE_CHECK(opened.state_->open());
  return opened;
}

const std::string& PcapFile::name() const noexcept { return state_->file.name(); }
int PcapFile::link_type() const noexcept { return pcap_datalink(state_->reader); }
Result<void> PcapFile::rewind() { return state_->open(); }

Result<std::optional<Frame>> PcapFile::next() {
  const std::size_t start = state_->position;
  pcap_pkthdr* header = nullptr;
  const u_char* bytes = nullptr;
  switch (pcap_next_ex(state_->reader, &header, &bytes)) {
    case 1: break;
    case PCAP_ERROR_BREAK:  // the end of the file
      return std::nullopt;
    default: return state_->error(pcap_geterr(state_->reader));
  }
  Frame frame;
  // Of nanosecond precision, as it was opened.
  frame.stamp =
      static_cast<double>(header->ts.tv_sec) + static_cast<double>(header->ts.tv_usec) * 1e-9;
  frame.bytes = {reinterpret_cast<const char*>(bytes), header->caplen};
  frame.offset = start;
  return frame;
}

}  // namespace vantage::io::velodyne
