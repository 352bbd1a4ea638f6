#include "tools/common/packed_text.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>
#include <vector>

#include <unistd.h>

#include "tools/common/frame_decoder.hpp"

namespace bmu {
namespace {

/// Bytes read at a time; and bytes kept after they were taken, to search for the next frame: a torn block includes the
/// following bytes before the damage is detected, and no block of zstd is longer than this. Those of gzip may be
/// longer: a gzip frame that started further back is not found.
constexpr std::size_t read_size = 131'072;
constexpr std::size_t kept_size = 131'072 + 1'024;
constexpr std::size_t room_size = kept_size + read_size;
/// Search range for a frame in a file that does not start with one: the first frame may have lost its magic, and that
/// of a recording, with the state of a large pack, may be long.
constexpr std::size_t begin_max = 1'048'576;

bool may_be_packed(std::string_view bytes) {
  return std::any_of(packings().begin(), packings().end(),
                     [bytes](const Packing& one) { return bytes.size() < one.begin_size && one.may_begin(bytes); });
}

const Packing* packing_of(std::string_view bytes) {
  const auto found =
      std::find_if(packings().begin(), packings().end(), [bytes](const Packing& one) { return one.begins(bytes); });
  return found == packings().end() ? nullptr : &*found;
}

/// More than half of compressed bytes are not letters; a log may contain a few such bytes.
bool is_binary(std::string_view bytes) {
  const auto is_odd = [](char letter) {
    const auto code = static_cast<unsigned char>(letter);
    return code >= 0x7F || (code < 0x20 && code != '\n' && code != '\r' && code != '\t');
  };
  const auto odd = static_cast<std::size_t>(std::count_if(bytes.begin(), bytes.end(), is_odd));
  return odd > bytes.size() / 4;
}

/// Indexed by the first byte, which decides for most of a text.
std::array<bool, 256> first_bytes() {
  std::array<bool, 256> may_be_first{};
  for (std::size_t code = 0; code < may_be_first.size(); ++code) {
    const char byte = static_cast<char>(code);
    may_be_first[code] = may_be_packed({&byte, 1});
  }
  return may_be_first;
}

enum class Trial : std::uint8_t { no_frame, too_short, frame };

/// Decompresses tentatively: bytes that start like a frame by chance give no text.
Trial tried(const Packing& packing, std::string_view bytes) {
  if (bytes.size() < packing.begin_size) return Trial::too_short;
  const std::unique_ptr<FrameDecoder> decoder = packing.make_decoder();
  std::array<char, 256> text{};
  while (!bytes.empty()) {
    const FrameDecoder::Step done = decoder->step(bytes, text);
    if (done.given > 0) return Trial::frame;
    if (!done.damage.empty() || done.is_frame_end || done.taken == 0) return Trial::no_frame;
    bytes.remove_prefix(done.taken);
  }
  return Trial::too_short;
}

}  // namespace

class PackedText::Unpacker {
 public:
  explicit Unpacker(int fd) : fd_(fd), bytes_(room_size) {}

  Read read(std::span<char> into);
  [[nodiscard]] const Damage& damage() const { return damage_; }
  [[nodiscard]] bool is_packed() const { return form_ == Form::packed || form_ == Form::refused; }

 private:
  enum class Form : std::uint8_t {
    unknown,
    doubtful,  // no frame at the start; plain text, unless a frame follows
    plain,
    packed,
    refused
  };
  enum class Refill : std::uint8_t { more, end, interrupted, failed };

  [[nodiscard]] Read find_form();
  [[nodiscard]] Read read_doubtful(std::span<char> into);
  [[nodiscard]] bool look_for_frame();
  [[nodiscard]] Read begin_behind_damage();
  [[nodiscard]] Read read_plain(std::span<char> into);
  [[nodiscard]] Read give_plain(std::span<char> into, std::size_t until);
  [[nodiscard]] Read read_packed(std::span<char> into);
  [[nodiscard]] Read unpack(std::span<char> into);
  [[nodiscard]] Read unpack_or_refill(std::span<char> into);
  [[nodiscard]] Read search();
  [[nodiscard]] Read refuse();
  [[nodiscard]] Refill refill();
  void begin_damage(std::string what);
  [[nodiscard]] Read end_damage();
  [[nodiscard]] std::uint64_t offset_of(std::size_t at) const { return offset_ + at; }
  [[nodiscard]] std::string_view left() const { return {bytes_.data() + at_, end_ - at_}; }

  int fd_;
  Form form_ = Form::unknown;
  const Packing* packing_ = nullptr;
  std::unique_ptr<FrameDecoder> decoder_;  // for compressed input
  std::vector<char> bytes_;                // input: taken up to at_, pending up to end_
  std::size_t at_ = 0;
  std::size_t end_ = 0;
  std::size_t look_at_ = 0;        // while doubtful: no frame starts before this
  std::size_t text_end_ = 0;       // while doubtful: bytes before this are plain text
  std::uint64_t offset_ = 0;       // of bytes_[0] in the file
  std::uint64_t frame_begin_ = 0;  // offset of the current frame, or of the next
  bool is_in_frame_ = false;
  bool is_searching_ = false;  // for the next frame after damage
  bool is_at_end_ = false;
  bool has_text_left_ = false;  // inside the decoder: text that did not fit
  Damage damage_;
};

PackedText::Read PackedText::Unpacker::read(std::span<char> into) {
  if (form_ == Form::unknown) {
    const Read found = find_form();
    if (form_ == Form::unknown) return found;
  }
  if (form_ == Form::doubtful) return read_doubtful(into);
  if (form_ == Form::refused) return refuse();
  return form_ == Form::plain ? read_plain(into) : read_packed(into);
}

PackedText::Read PackedText::Unpacker::find_form() {
  while (may_be_packed(left())) {  // else the form is known: interactive input must not wait
    const Refill got = refill();
    if (got == Refill::end) break;
    if (got == Refill::interrupted) return {Status::interrupted};
    if (got == Refill::failed) return {Status::failed};
  }
  packing_ = packing_of(left());
  form_ = packing_ == nullptr ? Form::doubtful : packing_->make_decoder == nullptr ? Form::refused : Form::packed;
  if (form_ == Form::packed) decoder_ = packing_->make_decoder();
  return {};
}

/// Reports the whole file as one damage.
PackedText::Read PackedText::Unpacker::refuse() {
  while (!is_at_end_) {
    at_ = end_;
    const Refill got = refill();
    if (got == Refill::interrupted) return {Status::interrupted};
    if (got == Refill::failed) return {Status::failed};
  }
  if (!damage_.what.empty()) return {Status::end};
  damage_ = {.begin = 0, .end = offset_of(end_), .what = std::string(packing_->refusal)};
  return {Status::damaged};
}

/// Plain text is returned as it arrives; binary bytes are held until a frame is found, or the search range ends.
PackedText::Read PackedText::Unpacker::read_doubtful(std::span<char> into) {
  while (true) {
    if (at_ < text_end_) return give_plain(into, text_end_);  // evaluated as a whole, for any size of `into`
    if (look_for_frame()) return begin_behind_damage();
    if (look_at_ > at_ && !is_binary(left().substr(0, look_at_ - at_))) {
      text_end_ = look_at_;
      continue;
    }
    if (is_at_end_ || offset_of(end_) >= begin_max) break;
    const Refill got = refill();
    if (got == Refill::interrupted) return {Status::interrupted};
    if (got == Refill::failed) return {Status::failed};
  }
  form_ = Form::plain;
  return read_plain(into);
}

/// True: a frame starts at look_at_. False: none starts before it.
bool PackedText::Unpacker::look_for_frame() {
  static const std::array<bool, 256> may_be_first = first_bytes();
  for (; look_at_ < end_; ++look_at_) {
    const std::string_view bytes(bytes_.data() + look_at_, end_ - look_at_);
    if (!may_be_first[static_cast<unsigned char>(bytes[0])]) continue;
    for (const Packing& one : packings()) {
      if (one.make_decoder == nullptr || !one.may_begin(bytes)) continue;
      const Trial trial = tried(one, bytes);
      if (trial == Trial::too_short && !is_at_end_) return false;
      if (trial != Trial::frame) continue;
      packing_ = &one;
      return true;
    }
  }
  return false;
}

PackedText::Read PackedText::Unpacker::begin_behind_damage() {
  at_ = look_at_;
  form_ = Form::packed;
  decoder_ = packing_->make_decoder();
  damage_ = {.begin = 0,
             .end = offset_of(at_),
             .what = "no " + std::string(packing_->frame) + " begins here, but one behind it"};
  return {Status::damaged};
}

/// Copies bytes that were read already.
PackedText::Read PackedText::Unpacker::give_plain(std::span<char> into, std::size_t until) {
  const std::size_t size = std::min(into.size(), until - at_);
  std::memcpy(into.data(), bytes_.data() + at_, size);
  at_ += size;
  return {Status::text, size};
}

PackedText::Read PackedText::Unpacker::read_plain(std::span<char> into) {
  if (at_ < end_) return give_plain(into, end_);
  const ssize_t count = ::read(fd_, into.data(), into.size());
  if (count < 0) return {errno == EINTR ? Status::interrupted : Status::failed};
  return {count == 0 ? Status::end : Status::text, static_cast<std::size_t>(count)};
}

PackedText::Unpacker::Refill PackedText::Unpacker::refill() {
  if (is_at_end_) return Refill::end;
  if (end_ == bytes_.size()) {
    const std::size_t gone = at_ - std::min(at_, kept_size);
    std::memmove(bytes_.data(), bytes_.data() + gone, end_ - gone);
    offset_ += gone;
    at_ -= gone;
    end_ -= gone;
    look_at_ -= std::min(look_at_, gone);
    text_end_ -= std::min(text_end_, gone);
  }
  if (end_ == bytes_.size()) bytes_.resize(2 * bytes_.size());  // all bytes are still needed
  const ssize_t count = ::read(fd_, bytes_.data() + end_, bytes_.size() - end_);
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

/// Text of size 0: call again.
PackedText::Read PackedText::Unpacker::unpack_or_refill(std::span<char> into) {
  if (at_ < end_ || has_text_left_) return unpack(into);
  switch (refill()) {
    case Refill::more: return {Status::text};
    case Refill::interrupted: return {Status::interrupted};
    case Refill::failed: return {Status::failed};
    case Refill::end: break;
  }
  if (!is_in_frame_) return {Status::end};
  begin_damage("this " + std::string(packing_->frame) + " has no end");
  return {Status::text};
}

PackedText::Read PackedText::Unpacker::unpack(std::span<char> into) {
  if (!is_in_frame_) frame_begin_ = offset_of(at_);
  FrameDecoder::Step done = decoder_->step(left(), into);
  at_ += done.taken;
  if (!done.damage.empty()) {
    begin_damage(std::move(done.damage));
  } else {
    is_in_frame_ = !done.is_frame_end;
    has_text_left_ = done.has_more;
  }
  return {Status::text, done.given};
}

/// The kept bytes are searched again from the byte after the start of the damaged frame.
void PackedText::Unpacker::begin_damage(std::string what) {
  damage_ = {.begin = frame_begin_, .end = frame_begin_, .what = std::move(what)};
  is_searching_ = true;
  is_in_frame_ = false;
  has_text_left_ = false;
  decoder_->reset();
  at_ = frame_begin_ + 1 > offset_ ? static_cast<std::size_t>(frame_begin_ + 1 - offset_) : 0;
  at_ = std::min(at_, end_);
}

PackedText::Read PackedText::Unpacker::search() {
  for (; end_ - at_ >= packing_->begin_size; ++at_) {
    if (packing_->begins(left())) return end_damage();
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
