// Compiles GLSL like glslangValidator, with a child process for each shader. glslang reads its
// built-in functions once, which is nearly all of glslangValidator's time.
//
// Arguments: the folder that #include reads. Each request on standard input is a line "STAGE LENGTH
// TARGET" and the text; STAGE is frag or comp, and TARGET is the file for the SPIR-V. The reply
// is a line "STATUS LENGTH" and the messages. STATUS is negative for a signal.

#include <glslang/Public/ResourceLimits.h>
#include <glslang/Public/ShaderLang.h>
#include <glslang/SPIRV/GlslangToSpv.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

namespace
{

class Includer : public glslang::TShader::Includer
{
  public:
    explicit Includer(std::string folder) : folder(std::move(folder))
    {
    }

    IncludeResult *includeLocal(const char *name, const char *, size_t depth) override
    {
        std::ifstream file(folder + "/" + name, std::ios::binary);
        if (!file || depth > 100) {
            return nullptr;
        }
        std::ostringstream content;
        content << file.rdbuf();
        auto *text = new std::string(content.str());
        return new IncludeResult(folder + "/" + name, text->data(), text->size(), text);
    }

    void releaseInclude(IncludeResult *result) override
    {
        if (result) {
            delete static_cast<std::string *>(result->userData);
            delete result;
        }
    }

  private:
    std::string folder;
};

int compile(const std::string &stage, const std::string &text, const char *target,
            const std::string &folder)
{
    EShLanguage language = stage == "comp" ? EShLangCompute : EShLangFragment;
    auto messages = static_cast<EShMessages>(EShMsgSpvRules | EShMsgVulkanRules);
    glslang::TShader shader(language);
    const char *strings[] = {text.c_str()};
    const int lengths[] = {static_cast<int>(text.size())};
    shader.setStringsWithLengths(strings, lengths, 1);
    shader.setEnvInput(glslang::EShSourceGlsl, language, glslang::EShClientVulkan, 100);
    shader.setEnvClient(glslang::EShClientVulkan, glslang::EShTargetVulkan_1_1);
    shader.setEnvTarget(glslang::EShTargetSpv, glslang::EShTargetSpv_1_3);
    Includer includer(folder);
    bool done = shader.parse(GetDefaultResources(), 110, false, messages, includer);
    std::cout << shader.getInfoLog();
    glslang::TProgram program;
    program.addShader(&shader);
    // The messages are those of glslangValidator, which also links what it could not parse.
    done = program.link(messages) && done;
    std::cout << program.getInfoLog();
    if (!done) {
        std::cout << "SPIR-V is not generated for failed compile or link\n";
        return 2;
    }
    std::vector<unsigned> words;
    glslang::GlslangToSpv(*program.getIntermediate(language), words);
    std::ofstream(target, std::ios::binary)
        .write(reinterpret_cast<const char *>(words.data()),
               static_cast<std::streamsize>(words.size() * sizeof words[0]));
    return 0;
}

// The limits of vkbloom/_custom/compiler.py.
void limit()
{
    const rlimit processor = {20, 20}, memory = {rlim_t(2) << 30, rlim_t(2) << 30},
                 file = {64 << 20, 64 << 20}, core = {0, 0};
    setrlimit(RLIMIT_CPU, &processor);
    setrlimit(RLIMIT_AS, &memory);
    setrlimit(RLIMIT_FSIZE, &file);
    setrlimit(RLIMIT_CORE, &core);
}

std::string read_all(int descriptor)
{
    std::string all;
    char part[4096];
    for (ssize_t got; (got = read(descriptor, part, sizeof part)) > 0;) {
        all.append(part, static_cast<size_t>(got));
    }
    return all;
}

}  // namespace

int main(int count, char **arguments)
{
    std::string folder = count > 1 ? arguments[1] : ".";
    glslang::InitializeProcess();
    // The built-in functions are read with the first shader of a stage.
    for (const char *stage : {"frag", "comp"}) {
        compile(stage, "#version 450\nvoid main() {}\n", "/dev/null", folder);
    }
    std::string line;
    while (std::getline(std::cin, line)) {
        std::istringstream words(line);
        std::string stage, target;
        size_t length = 0;
        words >> stage >> length;
        std::getline(words >> std::ws, target);
        std::string text(length, '\0');
        std::cin.read(&text[0], static_cast<std::streamsize>(length));
        int ends[2];
        if (pipe(ends) != 0) {
            return 1;
        }
        std::cout.flush();
        pid_t child = fork();
        if (child == 0) {
            dup2(ends[1], STDOUT_FILENO);
            close(ends[0]);
            close(ends[1]);
            limit();
            int status = compile(stage, text, target.c_str(), folder);
            std::cout.flush();
            _exit(status);
        }
        close(ends[1]);
        std::string messages = child < 0 ? "" : read_all(ends[0]);
        close(ends[0]);
        int status = 1;
        waitpid(child, &status, 0);
        status = WIFSIGNALED(status) ? -WTERMSIG(status) : WEXITSTATUS(status);
        std::cout << status << " " << messages.size() << "\n" << messages << std::flush;
    }
    return 0;
}
