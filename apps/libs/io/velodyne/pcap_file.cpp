#include "io/velodyne/pcap_file.hpp"

#include <fmt/format.h>
#include <pcap/pcap.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <string>
#include <utility>

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
  // How much of the file libpcap has read [bytes].
  [[nodiscard]] std::size_t position() const noexcept {
    return static_cast<std::size_t>(std::max<off_t>(::ftello(stream), 0));
  }
  // As read(2) and lseek(2).
  [[nodiscard]] ssize_t read(char* bytes, std::size_t size) noexcept;
  [[nodiscard]] int seek(off64_t& offset, int from) noexcept;

  InputFile file;
  std::FILE* stream = nullptr;
  pcap_t* reader = nullptr;
  std::size_t read_to = 0;       // by the stream's buffer [bytes]
  std::optional<Error> failure;  // of reading the file; libpcap cannot pass it on
};

namespace {

constexpr std::size_t kBufferSize = std::size_t{1} << 18U;

std::string_view without_line_ends(std::string_view text) noexcept {
  return text.substr(0, text.find_first_of("\r\n"));
}

}  // namespace

ssize_t PcapFile::State::read(char* bytes, std::size_t size) noexcept {
  size = std::min(size, file.size() - read_to);
  if (auto done = file.read(read_to, {bytes, size}); !done) {
    failure = std::move(done).error();
    errno = EIO;
    return -1;
  }
  read_to += size;
  return static_cast<ssize_t>(size);
}

int PcapFile::State::seek(off64_t& offset, int from) noexcept {
  const auto size = static_cast<off64_t>(file.size());
  const off64_t start =
      from == SEEK_CUR ? static_cast<off64_t>(read_to) : (from == SEEK_END ? size : 0);
  if (offset < -start || offset > size - start) return -1;
  offset += start;
  read_to = static_cast<std::size_t>(offset);
  return 0;
}

tl::unexpected<Error> PcapFile::State::error(const char* message) const {
  if (failure) return fail(*failure);
  return fail(ErrorCode::corrupt_data,
              fmt::format("the capture cannot be read on at byte {} of {}: {:.200}", position(),
                          file.size(), without_line_ends(message)),
              SourceLocation{file.name(), 0, 0});
}

Result<void> PcapFile::State::open() {
  close();
  read_to = 0;
  failure.reset();
  cookie_io_functions_t functions{};
  functions.read = [](void* state, char* bytes, std::size_t size) {
    return static_cast<State*>(state)->read(bytes, size);
  };
  functions.seek = [](void* state, off64_t* offset, int from) {
    return static_cast<State*>(state)->seek(*offset, from);
  };
  stream = ::fopencookie(this, "r", functions);
  if (stream == nullptr) {
    return fail(ErrorCode::io_failure,
                fmt::format("cannot be opened as a stream ({})", system_message(errno)),
                SourceLocation{file.name(), 0, 0});
  }
  std::setvbuf(stream, nullptr, _IOFBF, kBufferSize);  // libpcap asks for few bytes at a time
  std::array<char, PCAP_ERRBUF_SIZE> message{};
  reader =
      pcap_fopen_offline_with_tstamp_precision(stream, PCAP_TSTAMP_PRECISION_NANO, message.data());
  if (reader != nullptr) return {};
  auto failed = error(message.data());
  std::fclose(stream);
  return failed;
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
  const std::size_t start = state_->position();
  pcap_pkthdr* header = nullptr;
  const u_char* bytes = nullptr;
  switch (pcap_next_ex(state_->reader, &header, &bytes)) {
    case 1: break;
    case PCAP_ERROR_BREAK:  // the end of the file
      return std::nullopt;
    default: return state_->error(pcap_geterr(state_->reader));
  }
  Frame frame;
  // In nanoseconds, because the file was opened with this precision.
  frame.stamp =
      static_cast<double>(header->ts.tv_sec) + static_cast<double>(header->ts.tv_usec) * 1e-9;
  frame.bytes = {reinterpret_cast<const char*>(bytes), header->caplen};
  frame.offset = start;
  return frame;
}

}  // namespace vantage::io::velodyne
