"""Sentences of reports in Portuguese: whatever the code may say has an entry, and is put together rightly."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
# what programs, farms and terminals are told: the interface shows none of it
OF_PROGRAMS = {
    "operators": {"command_line", "farm", "farm_child", "convergence_operator", "example_room", "settings", "listed"},
    "operators/baking": {"adaptive_mesh", "finer_mesh", "left_out"},
    "operators/reporting": {"convergence_page", "cycles_script", "graph_image", "peak_memory", "ramp", "render_image"},
    "pdm_core": {"checked", "form_factors", "lights", "published", "radiosity", "read_off"},
    "pdm_core/links": {"kept", "solution"},
    "pdm_core/rays": {"kept", "direct", "aimed"},
}
FOLDERS = "operators", "operators/baking", "operators/reporting", "operators/reading"
FOLDERS += ("pdm_core", "pdm_core/links", "pdm_core/rays", "pdm_core/shapes")
SENTENCE = re.compile(r"(?!(Mesh|Plane|Polygon|Sphere) [a-z]+( {})?$).*[a-z]{2,} [a-z]")  # these are arguments
# parts of sentences that stand here whole, with what they are put into: EXAMPLES
PARTS = {
    "they are", "it is", "mesh of {} face{}", "finer in places",
    "without an image", "of operation {}, which is not read", "whose {} is not in use",
    "whose {} coordinates are not read", "of {} attribute {}, which is not read", "whose {} is not read",
    "{}{}: the socket's plain value is used{}", "{} and takes no part in this light",
    "a map of all directions, {} pixels around", "{} was rendered once into {}: what is finer is lost",
    "Sun of world {}", "Sun of world", "lets light through", "scatters light below its surface", "is not supported",
    "it shows the baked attribute {}, which is not read: the plain value of {}", "{} is used", "multiplied into",
    "added to", "finer cells hardly help; raise the", "raise the", "raise the time limit or",
    "finer rays hardly help; raise the", "{} target error",
    "raise the time limit or the", "it looks and what hides it", "they look and what hides them",
    "{} {} no surface that reflects, or only places too small to be sent on; check where {}",
    "is not read; save it as a single PNG, HDR or EXR and use that", "it has {}: that is left out",
    "without area: {} left out", "on another face of its own: {} read once", "{} send{} none (see the warnings)",
    "{} {} turned away from all objects: nothing is lit; turn or move {}", "Nothing is lit: {}; turn or move {}",
    "All is black: {} reflect{} nothing, whatever the light; give the materials a Base Color above black (their notes "
    "tell of shaders that are taken as black), or bake Irradiance",
    "Of their own light, dark surfaces are off by more than {} times the target ({}); {}lower the target error",
    "{} {} right before object {} or within it: nearly all light ends on it within {} m; turn or move the light, or "
    "disable the object in renders", "Name the colour layer that the light is to be {}",
    "Nothing shines: {}add a light, give an object a material that emits, or the world a colour above black",
}  # fmt: skip
# no sentences, or of programs
NOT_SHOWN = {
    "text fraction error said", "position normal radius id velocity rest_position material_index sharp_face sharp_edge "
    "crease_vert crease_edge bevel_weight_vert bevel_weight_edge custom_normal freestyle_edge freestyle_face",
    "nodes switched on", "free pairs",
    "Surface {} varies from place to place; solve again to see it changed", "surfaces that no light reaches",
    "colour channels that are multiples of others",
    "relight changes the colours of lights alone; where one is moved or resized, solve again",
    "relight: the background was dark and now sends light; solve again", "A surface without a name",
    "A surface's name is {}; use a string", "{}: its shape is {}; give a Plane, Sphere, Polygon or Mesh",
    "{}: side is {}; use 'front' or 'back'", "{}: reflectance is {}; use numbers below 1, at most {}",
    "a relative one such as 2**-53 or 2**-24", "Scene: {} is no list; give one of {}", "metres above 0",
    "Scene: {} is no {}; give a list of {}", "lights: PointLight, SpotLight, SunLight or AreaLight",
    "Mesh of {} vertices and {} faces", "{} must have shape (n, 3) with at least 3 corners, not {}",
    "Mesh smooth is of shape {}; give True, False, one of them for each of {} faces, or a normal for each of {} "
    "vertices or {} corners", "Mesh faces must be at least one, of at least 3 corners each",
    "Mesh faces have corners that are no vertex; use indices from 0 to {}",
    "Mesh vertices must have shape (n, 3), not {}",
    "Mesh faces are {}; give (f, 3) or a list of corner lists", "Polygon: holes are {}; give a list of outlines (n, 3)",
    "Scene rounding", "Scene background", "shadow rays", "a whole number above 0",
    "patch_radiosity: {}; use solve", "patch_radiosity: {} patches are more than {}; use fewer divisions",
}  # fmt: skip
EXAMPLES = {
    "targets from 0.125 % on are left out: the time limit":
        "pedidos a partir de 0.125 % ficam de fora: o limite de tempo",
    "Published method, 3 x 3 patches, 5 points": "Método publicado, 3 x 3 retalhos, 5 pontos",
    "Object 'Cube' has 3 faces without area: they are left out": "Objeto 'Cube' tem 3 faces sem área: ficam de fora",
    "has 1 face on another face of its own: it is read once": "tem 1 face sobre outra face sua: lida uma só vez",
    "Material 'A; b: c' (objects 'D', 'E' and 2 more): the Base Color of its Diffuse BSDF node is linked to Image "
    "Texture node 'F', whose image 'g' is a movie and is not read: the socket's plain value is used; save it as a "
    "single PNG, HDR or EXR and use that":
        "Material 'A; b: c' (objetos 'D', 'E' e mais 2): Base Color do seu nó Diffuse BSDF está ligado a nó Image "
        "Texture 'F'; a imagem 'g' é um filme e não se lê: conta o valor simples da entrada; guarde-a num só PNG, HDR "
        "ou EXR e use esse",
    "Nothing to bake: add a mesh object, or select one ('Light' has no faces; 'X' is of type 'CURVE'; convert it "
    "to a mesh)":
        "Não há nada a calcular: acrescente uma malha, ou selecione uma ('Light' não tem faces; 'X' é do tipo 'CURVE'; "
        "converta-o em malha)",
    "2 UV spheres, 1 plane, mesh of 300 faces": "2 esferas UV, 1 plano, malha de 300 faces",
    "Lights 'a', 'b' are turned away from all objects: nothing is lit; turn or move them":
        "Luzes 'a', 'b' estão de costas para todos os objetos: nada é iluminado; vire-as ou mova-as",
    "Nothing is lit: Light 'a' is turned away from all objects; turn or move it":
        "Nada é iluminado: Luz 'a' está de costas para todos os objetos; vire-a ou mova-a",
    "Nothing shines: light 'a' sends none (see the warnings); add a light, give an object a material that emits, or "
    "the world a colour above black":
        "Nada brilha: a luz 'a' não dá nenhuma (veja os avisos); acrescente uma luz, dê a um objeto um material que "
        "emite, ou ao mundo uma cor acima do preto",
    "surfaces: 12 on 6 shapes, lights: 1, target: 1 %": "superfícies: 12 em 6 formas, luzes: 1, pedido: 1 %",
    "'Lamp' lights no surface that reflects, or only places too small to be sent on; check where it looks and what "
    "hides it":
        "'Lamp' não ilumina nada que reflita, ou só lugares demasiado pequenos; veja para onde olha e o que a tapa",
    "World 'World': its Sky Texture node was rendered once into a map of all directions, 1024 pixels around: what is "
    "finer is lost":
        "Mundo 'World': o seu nó Sky Texture foi calculado uma vez num mapa de todas as direções, 1024 píxeis em "
        "volta: o que é mais fino perde-se",
}  # fmt: skip


def template(node):
    """The text of a literal, with {} for values, or None."""
    if isinstance(node, ast.JoinedStr):
        return "".join(part.value if isinstance(part, ast.Constant) else "{}" for part in node.values)
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else None


def sentences():
    """(where, text) of whatever literal in the code may be a sentence, docstrings apart."""
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).glob("*.py")):
            if path.stem in OF_PROGRAMS.get(folder, ()) or path.stem.startswith(("portuguese", "world_script")):
                continue
            tree, skipped = ast.parse(path.read_text(encoding="utf-8")), set()
            for node in ast.walk(tree):
                if isinstance(node, ast.Expr):
                    skipped.add(id(node.value))
                elif isinstance(node, ast.JoinedStr):
                    skipped |= {id(part) for part in node.values}
            for node in ast.walk(tree):
                text = None if id(node) in skipped else template(node)
                if text and SENTENCE.match(text):
                    yield f"{folder}/{path.name}:{node.lineno}", text


def test_whatever_may_be_said_has_an_entry(addon):
    words, unknown = addon("operators.portuguese").WORDS, addon("operators.told").unknown
    found = [(where, text.strip(" ,;")) for where, text in sentences() if text not in words]
    assert len(found) > 200
    known = PARTS | NOT_SHOWN
    new = [(where, text) for where, text in found if text not in known and unknown(text.replace("{}", "'x'"))]
    assert new == [], "give them entries in operators/portuguese_sentences.py, or say here why not"
    assert known - {text for _, text in found} == set()  # what is listed is still there


def test_entries_have_their_values_and_are_said_once(addon):
    sentences, words = addon("operators.portuguese_sentences").SENTENCES, addon("operators.portuguese").WORDS
    wrong = [text for text, word in sentences.items() if not word or text.count("{}") != word.count("{}")]
    assert wrong == []
    assert [text for text in sentences if words.get(text, sentences[text]) != sentences[text]] == []


@pytest.fixture
def portuguese(addon, monkeypatch):
    """told() as who reads Portuguese sees it; a wheel comes without languages."""
    words = addon("operators.portuguese").WORDS | addon("operators.portuguese_sentences").SENTENCES
    monkeypatch.setattr(addon("operators.told"), "pgettext_iface", lambda text: words.get(text, text))
    return addon("operators.told").told


@pytest.mark.parametrize("text", EXAMPLES)
def test_sentences_are_put_together(portuguese, addon, text):
    assert addon("operators.told").unknown(text) == ""
    assert portuguese(text) == EXAMPLES[text]


def test_what_has_no_entry_stays(portuguese, addon):
    assert addon("operators.told").unknown("what is this new thing: it is left out") == "what is this new thing"
    assert portuguese("what is this new thing: it is left out") == "what is this new thing: fica de fora"
    assert portuguese("") == ""


def test_in_english_all_stays(addon):
    for text in EXAMPLES:
        assert addon("operators.told").told(text) == text
