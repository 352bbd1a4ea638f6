// A piece of text as one zstd frame. Frames one after another decompress to their texts one after another (RFC 8878,
// 3.1), so a file of them can be read up to its last whole one.
#pragma once

#include <memory>
#include <string>
#include <string_view>

struct ZSTD_CCtx_s;

namespace bmu {

class ZstdFrames {
 public:
  /// `level`: 1 to 19, as zstd's; 3 is its default.
  explicit ZstdFrames(int level = 3);
  ZstdFrames(const ZstdFrames&) = delete;
  ZstdFrames& operator=(const ZstdFrames&) = delete;
  ~ZstdFrames();

  /// With a checksum. Throws std::bad_alloc.
  [[nodiscard]] std::string compress(std::string_view text);

 private:
  ZSTD_CCtx_s* context_;
};

}  // namespace bmu
