#include "coupler/payload_packing.hpp"

#include <zstd.h>

#include <cstring>

namespace ocublast::coupler {
namespace {

/// Higher levels gain some percent on such data and cost several times as much.
constexpr int level = 1;
constexpr std::size_t word = sizeof(double);

/// Byte k of every word, for k = 0 ... 7; what is left over stays at the end.
void sort_bytes(const char* from, char* to, std::size_t size) {
  const std::size_t n = size / word;
  for (std::size_t k = 0; k < word; ++k)
    for (std::size_t i = 0; i < n; ++i) to[k * n + i] = from[i * word + k];
  std::memcpy(to + n * word, from + n * word, size - n * word);
}

void put_bytes_back(const char* from, char* to, std::size_t size) {
  const std::size_t n = size / word;
  for (std::size_t k = 0; k < word; ++k)
    for (std::size_t i = 0; i < n; ++i) to[i * word + k] = from[k * n + i];
  std::memcpy(to + n * word, from + n * word, size - n * word);
}

void combine(std::string& payload, const std::string& before) {
  if (payload.size() != before.size()) return;
  for (std::size_t i = 0; i < payload.size(); ++i)
    payload[i] = static_cast<char>(payload[i] ^ before[i]);
}

}  // namespace

PayloadPacker::PayloadPacker() : context_(ZSTD_createCCtx(), ZSTD_freeCCtx) {}

std::optional<std::string> PayloadPacker::pack(int channel, std::span<const std::byte> payload) {
  std::string plain(reinterpret_cast<const char*>(payload.data()), payload.size());
  std::string difference = plain;
  combine(difference, before_[channel]);
  before_[channel] = std::move(plain);
  sorted_.resize(difference.size());
  sort_bytes(difference.data(), sorted_.data(), difference.size());
  std::string packed(ZSTD_compressBound(sorted_.size()), '\0');
  const std::size_t n = ZSTD_compressCCtx(context_.get(), packed.data(), packed.size(),
                                          sorted_.data(), sorted_.size(), level);
  if (ZSTD_isError(n) != 0 || n >= payload.size()) return {};
  packed.resize(n);
  return packed;
}

PayloadUnpacker::PayloadUnpacker() : context_(ZSTD_createDCtx(), ZSTD_freeDCtx) {}

std::optional<std::string> PayloadUnpacker::unpack(int channel, std::span<const std::byte> packed,
                                                   std::size_t size) {
  std::string sorted(size, '\0');
  const std::size_t n =
      ZSTD_decompressDCtx(context_.get(), sorted.data(), size, packed.data(), packed.size());
  if (ZSTD_isError(n) != 0 || n != size) return {};
  std::string payload(size, '\0');
  put_bytes_back(sorted.data(), payload.data(), size);
  combine(payload, before_[channel]);
  before_[channel] = payload;
  return payload;
}

}  // namespace ocublast::coupler
