#include "tools/common/packed_text.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <new>
#include <string_view>
#include <utility>

#include <unistd.h>
#include <zstd.h>
#include <zstd_errors.h>

namespace bmu {
namespace {

constexpr int window_log_max = 24;
static_assert(std::size_t{1} << window_log_max == PackedText::window_max);

/// Read at a time; and kept behind what was taken, to look for the next frame in: a torn block swallows what follows
/// it before it is noticed, and no block is longer than this.
constexpr std::size_t read_size = 131'072;
constexpr std::size_t kept_size = ZSTD_BLOCKSIZE_MAX + 1'024;
constexpr std::size_t room_size = kept_size + read_size;

/// 28 B5 2F FD, as zstd files begin; and 50 to 5F 2A 4D 18, as frames that hold no text.
constexpr std::size_t magic_size = 4;
constexpr std::string_view frame_magic = "\x28\xB5\x2F\xFD";
constexpr std::string_view skippable_magic_tail = "\x2A\x4D\x18";

/// As far as the bytes go: fewer than four may begin one.
bool may_begin_frame(std::string_view bytes) {
  if (bytes.empty()) return true;
  const bool may_be_skippable = (static_cast<unsigned char>(bytes[0]) & 0xF0U) == 0x50U &&
                                skippable_magic_tail.starts_with(bytes.substr(1, magic_size - 1));
  return may_be_skippable || frame_magic.starts_with(bytes.substr(0, magic_size));
}

bool begins_frame(std::string_view bytes) {
  return bytes.size() >= magic_size && may_begin_frame(bytes);
}

/// What the shortest header of a frame takes; after that the library says what it wants next.
constexpr std::size_t header_size_min = 5;

std::string words_for(std::size_t code) {
  switch (ZSTD_getErrorCode(code)) {
    case ZSTD_error_prefix_unknown: return "no zstd frame begins here";
    case ZSTD_error_checksum_wrong: return "the checksum of this zstd frame is wrong: what it held may be";
    case ZSTD_error_frameParameter_windowTooLarge:
      return "this zstd frame wants more than 16 MB of memory (made with --ultra or --long); unpack it with zstd -d";
    case ZSTD_error_dictionary_wrong: return "this zstd frame was packed with a dictionary";
    default: return std::string("this zstd frame is damaged (") + ZSTD_getErrorName(code) + ")";
  }
}

}  // namespace

class PackedText::Unpacker {
 public:
  explicit Unpacker(int fd) : fd_(fd), bytes_(std::make_unique<char[]>(room_size)) {}
  Unpacker(const Unpacker&) = delete;
  Unpacker& operator=(const Unpacker&) = delete;
  ~Unpacker() { ZSTD_freeDCtx(context_); }

  Read read(std::span<char> into);
  [[nodiscard]] const Damage& damage() const { return damage_; }
  [[nodiscard]] bool is_packed() const { return form_ == Form::packed; }

 private:
  enum class Form : std::uint8_t { unknown, plain, packed };
  enum class Refill : std::uint8_t { more, end, interrupted, failed };

  [[nodiscard]] Read find_form();
  [[nodiscard]] Read read_plain(std::span<char> into);
  [[nodiscard]] Read read_packed(std::span<char> into);
  [[nodiscard]] Read unpack(std::span<char> into);
  [[nodiscard]] Read unpack_or_refill(std::span<char> into);
  [[nodiscard]] Read search();
  [[nodiscard]] Refill refill();
  void begin_damage(std::string what);
  [[nodiscard]] Read end_damage();
  [[nodiscard]] std::uint64_t offset_of(std::size_t at) const { return offset_ + at; }
  [[nodiscard]] std::string_view left() const { return {bytes_.get() + at_, end_ - at_}; }

  int fd_;
  Form form_ = Form::unknown;
  ZSTD_DCtx* context_ = nullptr;
  std::unique_ptr<char[]> bytes_;  // what was read: taken already up to at_, not yet up to end_
  std::size_t at_ = 0;
  std::size_t end_ = 0;
  std::uint64_t offset_ = 0;       // of bytes_[0] in the file
  std::uint64_t frame_begin_ = 0;  // offset of the frame that is open, or of the next
  std::size_t wanted_ = 0;         // by the library, of the frame that is open
  bool is_in_frame_ = false;
  bool is_searching_ = false;  // for the next frame behind damage
  bool is_at_end_ = false;
  bool has_text_left_ = false;  // inside the context: what was unpacked did not fit
  Damage damage_;
};

PackedText::Read PackedText::Unpacker::read(std::span<char> into) {
  if (form_ == Form::unknown) {
    const Read found = find_form();
    if (form_ == Form::unknown) return found;
  }
  return form_ == Form::plain ? read_plain(into) : read_packed(into);
}

PackedText::Read PackedText::Unpacker::find_form() {
  while (end_ < magic_size) {
    const Refill got = refill();
    if (got == Refill::end) break;
    if (got == Refill::interrupted) return {Status::interrupted};
    if (got == Refill::failed) return {Status::failed};
    if (!may_begin_frame(left())) break;  // plain already: whoever types shall not have to wait
  }
  form_ = begins_frame(left()) ? Form::packed : Form::plain;
  if (form_ == Form::plain) return {};
  context_ = ZSTD_createDCtx();
  if (context_ == nullptr) throw std::bad_alloc();
  ZSTD_DCtx_setParameter(context_, ZSTD_d_windowLogMax, window_log_max);
  return {};
}

PackedText::Read PackedText::Unpacker::read_plain(std::span<char> into) {
  if (at_ < end_) {
    const std::size_t size = std::min(into.size(), end_ - at_);
    std::memcpy(into.data(), bytes_.get() + at_, size);
    at_ += size;
    return {Status::text, size};
  }
  const ssize_t count = ::read(fd_, into.data(), into.size());
  if (count < 0) return {errno == EINTR ? Status::interrupted : Status::failed};
  return {count == 0 ? Status::end : Status::text, static_cast<std::size_t>(count)};
}

PackedText::Unpacker::Refill PackedText::Unpacker::refill() {
  if (is_at_end_) return Refill::end;
  if (end_ == room_size) {
    const std::size_t gone = at_ - std::min(at_, kept_size);
    std::memmove(bytes_.get(), bytes_.get() + gone, end_ - gone);
    offset_ += gone;
    at_ -= gone;
    end_ -= gone;
  }
  const ssize_t count = ::read(fd_, bytes_.get() + end_, room_size - end_);
  if (count < 0) return errno == EINTR ? Refill::interrupted : Refill::failed;
  end_ += static_cast<std::size_t>(count);
  is_at_end_ = count == 0;
  return is_at_end_ ? Refill::end : Refill::more;
}

PackedText::Read PackedText::Unpacker::read_packed(std::span<char> into) {
  while (true) {
    const Read done = is_searching_ ? search() : unpack_or_refill(into);
    if (done.status != Status::text || done.size > 0) return done;
  }
}

/// Text of size 0: not yet, go on.
PackedText::Read PackedText::Unpacker::unpack_or_refill(std::span<char> into) {
  if (at_ < end_ || has_text_left_) return unpack(into);
  switch (refill()) {
    case Refill::more: return {Status::text};
    case Refill::interrupted: return {Status::interrupted};
    case Refill::failed: return {Status::failed};
    case Refill::end: break;
  }
  if (!is_in_frame_) return {Status::end};
  begin_damage("this zstd frame has no end");
  return {Status::text};
}

/// A piece at a time, as the library asks for it: if the next one is damaged, what came before has been given out.
PackedText::Read PackedText::Unpacker::unpack(std::span<char> into) {
  if (!is_in_frame_) {
    frame_begin_ = offset_of(at_);
    wanted_ = header_size_min;
  }
  ZSTD_inBuffer in{bytes_.get() + at_, std::min(end_ - at_, wanted_), 0};
  ZSTD_outBuffer out{into.data(), into.size(), 0};
  const std::size_t wanted = ZSTD_decompressStream(context_, &out, &in);
  at_ += in.pos;
  if (ZSTD_isError(wanted) != 0) {
    begin_damage(words_for(wanted));
  } else {
    wanted_ = wanted;
    is_in_frame_ = wanted != 0;
    has_text_left_ = is_in_frame_ && out.pos == out.size;
  }
  return {Status::text, out.pos};
}

/// What was kept is looked through again from behind the start of the bad frame.
void PackedText::Unpacker::begin_damage(std::string what) {
  damage_ = {.begin = frame_begin_, .end = frame_begin_, .what = std::move(what)};
  is_searching_ = true;
  is_in_frame_ = false;
  has_text_left_ = false;
  ZSTD_DCtx_reset(context_, ZSTD_reset_session_only);
  at_ = frame_begin_ + 1 > offset_ ? static_cast<std::size_t>(frame_begin_ + 1 - offset_) : 0;
  at_ = std::min(at_, end_);
}

PackedText::Read PackedText::Unpacker::search() {
  for (; end_ - at_ >= magic_size; ++at_) {
    if (begins_frame(left())) return end_damage();
  }
  switch (refill()) {
    case Refill::more: return {Status::text};
    case Refill::interrupted: return {Status::interrupted};
    case Refill::failed: return {Status::failed};
    case Refill::end: break;
  }
  at_ = end_;
  return end_damage();
}

PackedText::Read PackedText::Unpacker::end_damage() {
  is_searching_ = false;
  damage_.end = offset_of(at_);
  return {Status::damaged};
}

PackedText::PackedText(int fd) : unpacker_(std::make_unique<Unpacker>(fd)) {}
PackedText::~PackedText() = default;

PackedText::Read PackedText::read(std::span<char> into) {
  return unpacker_->read(into);
}

const PackedText::Damage& PackedText::damage() const {
  return unpacker_->damage();
}

bool PackedText::is_packed() const {
  return unpacker_->is_packed();
}

}  // namespace bmu
