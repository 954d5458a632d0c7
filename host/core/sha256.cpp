#include "host/core/sha256.h"

#include <openssl/evp.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <vector>

#include "host/core/error.h"

namespace mote {

namespace {

class Sha256 {
 public:
  Sha256() : context_(EVP_MD_CTX_new(), &EVP_MD_CTX_free) {
    if (!context_ || EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) != 1)
      throw MachineError("SHA-256 is not available in this build of OpenSSL");
  }
  void add(const void* bytes, std::size_t size) { EVP_DigestUpdate(context_.get(), bytes, size); }
  /// 64 hexadecimal digits; once.
  std::string digits() {
    unsigned char digest[EVP_MAX_MD_SIZE];
    unsigned length = 0;
    EVP_DigestFinal_ex(context_.get(), digest, &length);
    std::string text;
    for (unsigned i = 0; i < length; ++i) text += fmt::format("{:02x}", digest[i]);
    return text;
  }

 private:
  std::unique_ptr<EVP_MD_CTX, void (*)(EVP_MD_CTX*)> context_;
};

}  // namespace

std::string sha256OfFile(const std::string& path) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!file) throw InputError(fmt::format("{}: cannot read: {}", path, std::strerror(errno)));
  Sha256 sum;
  std::vector<unsigned char> block(1 << 20);
  for (std::size_t size; (size = std::fread(block.data(), 1, block.size(), file.get())) > 0;)
    sum.add(block.data(), size);
  if (std::ferror(file.get())) throw InputError(fmt::format("{}: reading failed: {}", path, std::strerror(errno)));
  return sum.digits();
}

std::string sha256OfText(std::string_view text) {
  Sha256 sum;
  sum.add(text.data(), text.size());
  return sum.digits();
}

}  // namespace mote
