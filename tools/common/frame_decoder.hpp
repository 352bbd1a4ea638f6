// One way of packing text: how its frames begin, and what unpacks them piece by piece. packed_text.hpp reads files with
// it. What zstd calls a frame, gzip calls a member; here both are frames.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace bmu {

class FrameDecoder {
 public:
  struct Step {
    std::size_t taken = 0;  // of the packed bytes
    std::size_t given = 0;  // of the text; good also if there is damage behind it
    bool is_frame_end = false;
    bool has_more = false;  // text that did not fit: ask again, with no more packed bytes if there are none
    std::string damage;     // in words; empty: none
  };

  FrameDecoder() = default;
  FrameDecoder(const FrameDecoder&) = delete;
  FrameDecoder& operator=(const FrameDecoder&) = delete;
  virtual ~FrameDecoder() = default;

  /// Unpacks some of `packed`, as much as fits into `text`. The first step, and the one behind a frame's end, begin a
  /// frame.
  [[nodiscard]] virtual Step step(std::string_view packed, std::span<char> text) = 0;
  /// Forgets the frame that is open.
  virtual void reset() = 0;
};

/// What the first bytes of a file can tell.
struct Packing {
  std::string_view frame;  // "zstd frame"
  std::size_t begin_size;  // so many bytes tell that one begins
  /// Whether a frame may begin so, as far as the bytes go.
  bool (*may_begin)(std::string_view bytes);
  std::unique_ptr<FrameDecoder> (*make_decoder)();  // null: this is not read here
  std::string_view refusal;                         // then: what to do instead

  [[nodiscard]] bool begins(std::string_view bytes) const { return bytes.size() >= begin_size && may_begin(bytes); }
};

/// zstd and gzip, which are read; xz, bzip2 and lz4, which are not.
[[nodiscard]] std::span<const Packing> packings();

}  // namespace bmu
