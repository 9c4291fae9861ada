#include "spirv/instructions.h"

bool vkb_is_debug(const uint32_t *at)
{
    const uint32_t code = vkb_opcode(at);

    return (code >= SPV_SOURCE_CONTINUED && code <= SPV_LINE) || code == SPV_NO_LINE
        || code == SPV_MODULE_PROCESSED;
}

bool vkb_ends_block(const uint32_t *at)
{
    return (vkb_opcode(at) >= SPV_BRANCH && vkb_opcode(at) <= SPV_UNREACHABLE)
        || vkb_opcode(at) == SPV_TERMINATE_INVOCATION;
}

uint32_t vkb_target(const uint32_t *at, uint32_t i)
{
    switch (vkb_opcode(at)) {
    case SPV_BRANCH:
        return i == 0 ? at[1] : 0;
    case SPV_BRANCH_CONDITIONAL:
        return i < 2 ? at[2 + i] : 0;
    case SPV_SWITCH:
        return 2 + 2 * i < vkb_word_count(at) ? at[2 + 2 * i] : 0;
    }
    return 0;
}

// Whether it is an operation without an effect of its own that has a type and a result.
static bool is_plain(uint32_t code)
{
    return code == SPV_PHI || code == SPV_LOAD || code == SPV_ACCESS_CHAIN
        || code == SPV_IN_BOUNDS_ACCESS_CHAIN
        || (code >= SPV_VECTOR_EXTRACT_DYNAMIC && code <= SPV_IMAGE_READ)
        || (code >= SPV_IMAGE && code <= SPV_IMAGE_QUERY_SAMPLES)
        || (code >= SPV_CONVERT_F_TO_U && code <= SPV_FWIDTH_COARSE);
}

static bool is_type(uint32_t code)
{
    return code >= SPV_TYPE_VOID && code < SPV_TYPE_FORWARD_POINTER;
}

uint32_t vkb_result(const uint32_t *at)
{
    const uint32_t code = vkb_opcode(at);

    if (code == SPV_LABEL || is_type(code))
        return at[1];
    return code == SPV_EXT_INST || is_plain(code)
                || (code >= SPV_CONSTANT_TRUE && code <= SPV_SPEC_CONSTANT_OP)
                || (code >= SPV_FUNCTION && code <= SPV_VARIABLE && code != SPV_FUNCTION_END)
                || (code >= SPV_ATOMIC_LOAD && code <= SPV_ATOMIC_XOR && code != SPV_ATOMIC_STORE)
             ? at[2]
             : 0;
}

static bool set(uint32_t *value, uint32_t number)
{
    *value = number;
    return true;
}

static bool compare(uint32_t opcode, uint32_t x, uint32_t y, uint32_t *value)
{
    // Comparisons of signed integers have odd opcodes.
    const uint32_t sign = (opcode & 1) << 31;

    switch (opcode) {
    case SPV_U_GREATER:
    case SPV_S_GREATER:
        return set(value, (x ^ sign) > (y ^ sign));
    case SPV_U_GREATER_EQUAL:
    case SPV_S_GREATER_EQUAL:
        return set(value, (x ^ sign) >= (y ^ sign));
    case SPV_U_LESS:
    case SPV_S_LESS:
        return set(value, (x ^ sign) < (y ^ sign));
    case SPV_U_LESS_EQUAL:
    case SPV_S_LESS_EQUAL:
        return set(value, (x ^ sign) <= (y ^ sign));
    }
    return false;
}

bool vkb_arithmetic(uint32_t opcode, uint32_t x, uint32_t y, uint32_t *value)
{
    // Where signs make no difference.
    const bool divides = y != 0 && !((x | y) >> 31);

    switch (opcode) {
    case SPV_S_NEGATE:
        return set(value, 0 - x);
    case SPV_NOT:
        return set(value, ~x);
    case SPV_LOGICAL_NOT:
        return set(value, !x);
    case SPV_BITCAST:
        return set(value, x);
    case SPV_I_ADD:
        return set(value, x + y);
    case SPV_I_SUB:
        return set(value, x - y);
    case SPV_I_MUL:
        return set(value, x * y);
    case SPV_U_DIV:
    case SPV_S_DIV:
        return divides && set(value, x / y);
    case SPV_U_MOD:
    case SPV_S_REM:
    case SPV_S_MOD:
        return divides && set(value, x % y);
    case SPV_LOGICAL_EQUAL:
    case SPV_I_EQUAL:
        return set(value, x == y);
    case SPV_LOGICAL_NOT_EQUAL:
    case SPV_I_NOT_EQUAL:
        return set(value, x != y);
    case SPV_LOGICAL_OR:
        return set(value, x || y);
    case SPV_LOGICAL_AND:
        return set(value, x && y);
    case SPV_SHIFT_RIGHT_LOGICAL:
        return y < 32 && set(value, x >> y);
    case SPV_SHIFT_RIGHT_ARITHMETIC:
        return y < 32 && !(x >> 31) && set(value, x >> y);
    case SPV_SHIFT_LEFT_LOGICAL:
        return y < 32 && set(value, x << y);
    case SPV_BITWISE_OR:
        return set(value, x | y);
    case SPV_BITWISE_XOR:
        return set(value, x ^ y);
    case SPV_BITWISE_AND:
        return set(value, x & y);
    }
    return compare(opcode, x, y, value);
}
