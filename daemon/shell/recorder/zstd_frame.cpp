#include "daemon/shell/recorder/zstd_frame.hpp"

#include <new>

#include <zstd.h>

namespace bmu {

ZstdFrames::ZstdFrames(int level) : context_(ZSTD_createCCtx()) {
  if (context_ == nullptr) throw std::bad_alloc();
  static_cast<void>(ZSTD_CCtx_setParameter(context_, ZSTD_c_compressionLevel, level));
  static_cast<void>(ZSTD_CCtx_setParameter(context_, ZSTD_c_checksumFlag, 1));
}

ZstdFrames::~ZstdFrames() {
  ZSTD_freeCCtx(context_);
}

std::string ZstdFrames::compress(std::string_view text) {
  std::string frame(ZSTD_compressBound(text.size()), '\0');
  const std::size_t size = ZSTD_compress2(context_, frame.data(), frame.size(), text.data(), text.size());
  // With room for the worst case there is no other reason to fail.
  if (ZSTD_isError(size) != 0U) throw std::bad_alloc();
  frame.resize(size);
  frame.shrink_to_fit();
  return frame;
}

}  // namespace bmu
