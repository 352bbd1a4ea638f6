// One compression format: detection of its frames, and their decompression piece by piece. packed_text.hpp reads files
// with it. The term of zstd is frame, that of gzip member; here both are frames.
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
    std::size_t taken = 0;  // of the compressed bytes
    std::size_t given = 0;  // of the text; valid also if damage follows
    bool is_frame_end = false;
    bool has_more = false;  // text that did not fit: call again, without input if there is none
    std::string damage;     // as text; empty: none
  };

  FrameDecoder() = default;
  FrameDecoder(const FrameDecoder&) = delete;
  FrameDecoder& operator=(const FrameDecoder&) = delete;
  virtual ~FrameDecoder() = default;

  /// Decompresses part of `packed`, as much as fits into `text`. The first step, and the one after a frame's end, start
  /// a frame.
  [[nodiscard]] virtual Step step(std::string_view packed, std::span<char> text) = 0;
  /// Discards the current frame.
  virtual void reset() = 0;
};

/// A format and its detection by the first bytes of a file.
struct Packing {
  std::string_view frame;  // "zstd frame"
  std::size_t begin_size;  // number of bytes that identify its start
  /// True if a frame may start with these bytes, as far as they go.
  bool (*may_begin)(std::string_view bytes);
  std::unique_ptr<FrameDecoder> (*make_decoder)();  // null: the format is not supported
  std::string_view refusal;                         // for the message then: the remedy

  [[nodiscard]] bool begins(std::string_view bytes) const { return bytes.size() >= begin_size && may_begin(bytes); }
};

/// zstd and gzip, which are supported; xz, bzip2 and lz4, which are only detected.
[[nodiscard]] std::span<const Packing> packings();

}  // namespace bmu
