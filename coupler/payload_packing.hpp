#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>

struct ZSTD_CCtx_s;
struct ZSTD_DCtx_s;

namespace ocublast::coupler {

/// Payloads of one sender resemble each other from window to window: what is packed (zstd, level 1)
/// is the payload XOR the one before of the same channel where both have one length, its bytes
/// sorted by their place in a double, so that signs and exponents stand together. Exact.
class PayloadPacker {
 public:
  PayloadPacker();
  /// The packed bytes; nothing where packing gains nothing. Either way the payload is remembered.
  [[nodiscard]] std::optional<std::string> pack(int channel, std::span<const std::byte> payload);

 private:
  std::unique_ptr<ZSTD_CCtx_s, std::size_t (*)(ZSTD_CCtx_s*)> context_;
  std::map<int, std::string> before_;
  std::string sorted_;
};

class PayloadUnpacker {
 public:
  PayloadUnpacker();
  /// The payload of `size` bytes; nothing where the bytes are damaged.
  [[nodiscard]] std::optional<std::string> unpack(int channel, std::span<const std::byte> packed,
                                                  std::size_t size);
  /// A payload of the channel that was not packed.
  void remember(int channel, const std::string& payload) { before_[channel] = payload; }

 private:
  std::unique_ptr<ZSTD_DCtx_s, std::size_t (*)(ZSTD_DCtx_s*)> context_;
  std::map<int, std::string> before_;
};

}  // namespace ocublast::coupler
