#include "tools/common/frame_decoder.hpp"

#include <algorithm>
#include <array>
#include <new>

#define ZLIB_CONST  // the compressed input is not written to
#include <zlib.h>
#include <zstd.h>
#include <zstd_errors.h>

#include "tools/common/packed_text.hpp"

namespace bmu {
namespace {

/// Compares the available bytes only: they may be a part of the magic.
bool may_be(std::string_view magic, std::string_view bytes) {
  return magic.starts_with(bytes.substr(0, magic.size()));
}

// --- zstd -----------------------------------------------------------------------------------------------------------

constexpr int window_log_max = 24;
static_assert(std::size_t{1} << window_log_max == PackedText::window_max);

/// 28 B5 2F FD, the start of zstd files; and 50 to 5F 2A 4D 18, frames that hold no text.
constexpr std::size_t zstd_magic_size = 4;
constexpr std::string_view zstd_magic = "\x28\xB5\x2F\xFD";
constexpr std::string_view skippable_magic_tail = "\x2A\x4D\x18";

bool may_begin_zstd(std::string_view bytes) {
  if (bytes.empty()) return true;
  const bool may_be_skippable = (static_cast<unsigned char>(bytes[0]) & 0xF0U) == 0x50U &&
                                skippable_magic_tail.starts_with(bytes.substr(1, zstd_magic_size - 1));
  return may_be_skippable || may_be(zstd_magic, bytes);
}

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

class ZstdDecoder final : public FrameDecoder {
 public:
  ZstdDecoder() : context_(ZSTD_createDCtx()) {
    if (context_ == nullptr) throw std::bad_alloc();
    ZSTD_DCtx_setParameter(context_, ZSTD_d_windowLogMax, window_log_max);
  }
  ~ZstdDecoder() override { ZSTD_freeDCtx(context_); }

  /// Feeds one piece at a time, because the library does not report the output of a call that ends in damage. So a
  /// block is fed without the header of the next, and text that did not fit is taken out before further input.
  ///
  /// Bytes of a frame's head are fed one by one, because given several at once the library detects more: the magic of a
  /// format from before zstd 0.8, which it then decompresses and, on damage, reports as having filled the whole buffer;
  /// and within the header a whole frame, which it decompresses as this one if there is room for its text.
  Step step(std::string_view packed, std::span<char> text) override {
    const std::size_t piece = taken_ < header_size_max ? 1 : piece_;
    ZSTD_inBuffer in{packed.data(), has_text_left_ ? 0 : std::min(packed.size(), piece), 0};
    ZSTD_outBuffer out{text.data(), text.size(), 0};
    const std::size_t wanted = ZSTD_decompressStream(context_, &out, &in);
    if (ZSTD_isError(wanted) != 0) return {.taken = in.pos, .damage = words_for(wanted)};
    Step done{.taken = in.pos, .given = out.pos, .is_frame_end = wanted == 0};
    done.has_more = has_text_left_ = !done.is_frame_end && out.pos == out.size;
    taken_ = done.is_frame_end ? 0 : taken_ + in.pos;
    piece_ = piece_of(wanted);
    return done;
  }

  void reset() override {
    ZSTD_DCtx_reset(context_, ZSTD_reset_session_only);
    taken_ = 0;
    has_text_left_ = false;
  }

 private:
  static constexpr std::size_t header_size_max = 18;  // magic included
  static constexpr std::size_t block_header_size = 3;

  /// The library requests a block with the header of the next; for other requests, e.g. the last block, less is
  /// harmless.
  static std::size_t piece_of(std::size_t wanted) {
    return wanted > block_header_size ? wanted - block_header_size : wanted;
  }

  ZSTD_DCtx* context_;
  std::size_t taken_ = 0;  // bytes of the current frame
  std::size_t piece_ = 1;  // size of the next input after the head
  bool has_text_left_ = false;
};

// --- gzip -----------------------------------------------------------------------------------------------------------

/// 1F 8B 08; no flags except the five defined ones; after four bytes of a time the compression level, and one of the
/// few systems that have a number. Three bytes alone would occur by chance in damaged data.
bool may_begin_gzip(std::string_view bytes) {
  constexpr std::size_t flags_at = 3;
  constexpr std::size_t effort_at = 8;
  constexpr std::size_t system_at = 9;
  const auto code = [bytes](std::size_t at) { return static_cast<unsigned char>(bytes[at]); };
  const auto has = [bytes](std::size_t at) { return bytes.size() > at; };
  if (!may_be("\x1F\x8B\x08", bytes)) return false;
  if (has(flags_at) && code(flags_at) > 0x1F) return false;
  if (has(effort_at) && code(effort_at) != 0 && code(effort_at) != 2 && code(effort_at) != 4) return false;
  return !has(system_at) || code(system_at) <= 13 || code(system_at) == 0xFF;
}

class GzipDecoder final : public FrameDecoder {
 public:
  GzipDecoder() {
    if (inflateInit2(&stream_, window_bits + only_gzip) != Z_OK) throw std::bad_alloc();
  }
  ~GzipDecoder() override { inflateEnd(&stream_); }

  Step step(std::string_view packed, std::span<char> text) override {
    stream_.next_in = reinterpret_cast<const Bytef*>(packed.data());
    stream_.avail_in = static_cast<uInt>(packed.size());
    stream_.next_out = reinterpret_cast<Bytef*>(text.data());
    stream_.avail_out = static_cast<uInt>(text.size());
    const int result = inflate(&stream_, Z_NO_FLUSH);
    Step done{.taken = packed.size() - stream_.avail_in, .given = text.size() - stream_.avail_out};
    if (result == Z_MEM_ERROR) throw std::bad_alloc();
    if (result == Z_STREAM_END) {
      done.is_frame_end = true;
      inflateReset(&stream_);
    } else if (result == Z_OK || result == Z_BUF_ERROR) {  // the latter: no progress was possible
      done.has_more = stream_.avail_out == 0;
    } else {
      done.damage = words_of(stream_.msg == nullptr ? "" : stream_.msg);
    }
    return done;
  }

  void reset() override { inflateReset(&stream_); }

 private:
  static constexpr int window_bits = 15;
  static constexpr int only_gzip = 16;

  static std::string words_of(std::string_view library_words) {
    if (library_words == "incorrect data check" || library_words == "incorrect length check") {
      return "the checksum of this gzip stream is wrong: what it held may be";
    }
    if (library_words == "incorrect header check") return "no gzip stream begins here";
    return "this gzip stream is damaged (" + std::string(library_words) + ")";
  }

  z_stream stream_{};
};

// --------------------------------------------------------------------------------------------------------------------

template <class Decoder>
std::unique_ptr<FrameDecoder> make() {
  return std::make_unique<Decoder>();
}

constexpr std::array packing_table = {
    Packing{"zstd frame", zstd_magic_size, may_begin_zstd, make<ZstdDecoder>, ""},
    Packing{"gzip stream", 10, may_begin_gzip, make<GzipDecoder>, ""},
    Packing{"xz stream", 6,
            [](std::string_view bytes) {
              return may_be({"\xFD\x37zXZ\0", 6}, bytes);
            },
            nullptr, "this is packed with xz, which is not read here; unpack it with xz -d"},
    Packing{"bzip2 stream", 4,
            [](std::string_view bytes) {
              return may_be("BZh", bytes) && (bytes.size() < 4 || (bytes[3] >= '1' && bytes[3] <= '9'));
            },
            nullptr, "this is packed with bzip2, which is not read here; unpack it with bzip2 -d"},
    Packing{"lz4 frame", 4, [](std::string_view bytes) { return may_be("\x04\x22\x4D\x18", bytes); }, nullptr,
            "this is packed with lz4, which is not read here; unpack it with lz4 -d"},
};

}  // namespace

std::span<const Packing> packings() {
  return packing_table;
}

}  // namespace bmu
