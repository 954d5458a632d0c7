#include "host/particles/formats/number_cast.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>
#include <utility>

#include "host/core/error.h"
#include "host/core/parallel.h"
#include "host/particles/formats/number_visit.h"

namespace mote {
namespace {

constexpr std::size_t kGrain = 1 << 15;

/// Holds every number of every type.
using Wide = long double;
static_assert(std::numeric_limits<Wide>::digits >= 64);

template <class T>
Wide wide(T value) {
  if constexpr (std::is_same_v<T, Imath::half>)
    return static_cast<float>(value);
  else
    return value;
}

template <class To, class From>
To casted(From value) {
  if constexpr (std::is_same_v<To, From>) {
    return value;
  } else if constexpr (std::is_same_v<To, Imath::half>) {
    return Imath::half(static_cast<float>(value));
  } else if constexpr (!std::is_integral_v<To>) {
    return static_cast<To>(value);
  } else if constexpr (std::is_integral_v<From>) {
    if (std::cmp_less(value, std::numeric_limits<To>::min())) return std::numeric_limits<To>::min();
    if (std::cmp_greater(value, std::numeric_limits<To>::max())) return std::numeric_limits<To>::max();
    return static_cast<To>(value);
  } else {
    const double whole = std::nearbyint(static_cast<double>(value));
    if (std::isnan(whole)) return 0;
    if (whole < static_cast<double>(std::numeric_limits<To>::min())) return std::numeric_limits<To>::min();
    if (whole >= std::ldexp(1.0, std::numeric_limits<To>::digits)) return std::numeric_limits<To>::max();
    return static_cast<To>(whole);
  }
}

template <class From, class To>
std::uint64_t castBlock(const std::byte* from, std::size_t count, std::byte* to) {
  std::uint64_t changed = 0;
  for (std::size_t i = 0; i < count; ++i, from += sizeof(From), to += sizeof(To)) {
    From before;
    std::memcpy(&before, from, sizeof before);
    const To after = casted<To>(before);
    std::memcpy(to, &after, sizeof after);
    const Wide a = wide(before), b = wide(after);
    changed += a != b && !(std::isnan(a) && std::isnan(b));
  }
  return changed;
}

}  // namespace

bool isFloat(NumberType type) { return type == NumberType::F16 || type == NumberType::F32 || type == NumberType::F64; }

bool isSigned(NumberType type) {
  return withNumberType(type, []<class T>(T) { return std::numeric_limits<T>::is_signed; });
}

std::uint64_t castNumbers(NumberType fromType, std::span<const std::byte> from, NumberType toType,
                          std::span<std::byte> to) {
  const std::size_t fromSize = numberSize(fromType), toSize = numberSize(toType), count = from.size() / fromSize;
  MOTE_CHECK(to.size(), ==, count * toSize);
  if (fromType == toType) {
    if (count > 0) std::memcpy(to.data(), from.data(), from.size());
    return 0;
  }
  std::atomic<std::uint64_t> changed{0};
  parallelBlocks(count, kGrain, [&](std::size_t begin, std::size_t end) {
    changed += withNumberType(fromType, [&]<class From>(From) {
      return withNumberType(toType, [&]<class To>(To) {
        return castBlock<From, To>(from.data() + begin * fromSize, end - begin, to.data() + begin * toSize);
      });
    });
  });
  return changed;
}

NumberType commonType(NumberType a, NumberType b) {
  if (a == b) return a;
  const std::size_t size = std::max(numberSize(a), numberSize(b));
  if (isFloat(a) && isFloat(b)) return numberSize(a) > numberSize(b) ? a : b;
  if (isFloat(a) || isFloat(b)) {  // half has 11 bits, float 24, double 53
    const std::size_t whole = numberSize(isFloat(a) ? b : a), floating = numberSize(isFloat(a) ? a : b);
    if (whole == 1) return isFloat(a) ? a : b;
    return whole == 2 && floating <= 4 ? NumberType::F32 : NumberType::F64;
  }
  if (isSigned(a) == isSigned(b)) return numberSize(a) == size ? a : b;
  const std::size_t ofUnsigned = numberSize(isSigned(a) ? b : a), ofSigned = numberSize(isSigned(a) ? a : b);
  const std::size_t needed = std::max(ofSigned, 2 * ofUnsigned);
  return needed == 2   ? NumberType::I16
         : needed == 4 ? NumberType::I32
         : needed == 8 ? NumberType::I64
                       : NumberType::F64;
}

}  // namespace mote
