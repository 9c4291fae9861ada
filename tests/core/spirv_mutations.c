// Changes modules of SPIR-V at random and lets the core read them, in memory of exactly their size.
// Arguments: a file of modules, each after its number of bytes; how many changes of each; a seed.
#include "spirv/specialize.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint32_t state;

static uint32_t draw(uint32_t below)
{
    state ^= state << 13;
    state ^= state >> 17;
    state ^= state << 5;
    return below ? state % below : 0;
}

// Words that readers may take for ids, opcodes, numbers of words or literals.
static uint32_t draw_word(const uint32_t *words, size_t count)
{
    const uint32_t word = words[draw((uint32_t)count)];

    switch (draw(7)) {
    case 0:
        return draw(2) ? 0 : UINT32_MAX;
    case 1:
        return draw(words[3] + 2);
    case 2:
        return draw(400) | draw(8) << 16;
    case 3:
        return (word & 0xffff) | draw(8) << 16;
    case 4:
        return 1u << draw(32);
    }
    return word;
}

static size_t change(uint32_t *words, size_t count)
{
    const size_t at = 3 + draw((uint32_t)count - 3), step = 1 + draw(3);

    switch (draw(4)) {
    case 0:
        return at + 1;
    case 1:
        if (at + step >= count)
            return count;
        memmove(words + at, words + at + step, (count - at - step) * sizeof *words);
        return count - step;
    }
    for (uint32_t i = draw(3); i < 3; ++i)
        words[3 + draw((uint32_t)count - 3)] = draw_word(words, count);
    return count;
}

// Returns whether the core takes the module.
static int read_module(const uint32_t *words, size_t count)
{
    const size_t size = count * sizeof *words;
    uint32_t *exact = malloc(size), *code = NULL;
    struct vkb_error error = {0};
    struct vkb_constants constants;
    size_t made_size;

    if (!exact)
        abort();
    memcpy(exact, words, size);
    memset(&constants, 1, sizeof constants);
    const struct vkb_shader shader = {.name = "changed", .code = exact, .size = size};
    const int taken = vkb_specialize(&shader, &constants, &code, &made_size, &error);
    if (taken)
        vkb_free(code);
    free(exact);
    return taken;
}

int main(int count, char **arguments)
{
    FILE *file = count == 4 ? fopen(arguments[1], "rb") : NULL;
    uint32_t size, taken = 0, all = 0;

    if (!file)
        return 2;
    state = (uint32_t)atoi(arguments[3]) * 2654435761u + 1;
    while (fread(&size, sizeof size, 1, file) == 1) {
        size /= sizeof size;
        uint32_t *words = malloc(2 * size * sizeof *words), *changed = words ? words + size : NULL;
        if (!words || fread(words, sizeof *words, size, file) != size)
            return 2;
        for (int i = atoi(arguments[2]); i > 0; --i, ++all) {
            memcpy(changed, words, size * sizeof *words);
            taken += (uint32_t)read_module(changed, change(changed, size));
        }
        free(words);
    }
    printf("%u %u\n", taken, all);
    fclose(file);
    return 0;
}
