"""The interface in Portuguese, through Blender's own mechanism; {} stand for values."""

import bpy

from .portuguese_sentences import SENTENCES

LANGUAGES = "pt_PT", "pt_BR"
CONTEXTS = "*", "Operator"  # of the names of operators Blender asks in a context of their own
WORDS = {
    # the panel
    "PDM Radiosity": "Radiosidade PDM",
    "Advanced": "Avançado",
    "Objects": "Objetos",
    "Report": "Relatório",
    "Details": "Detalhes",
    "Error Against Time": "Erro e tempo",
    "Nothing shines yet: add a light, give an object a material with Emission, or the world a colour":
        "Ainda nada brilha: acrescente uma luz, dê a um objeto um material com Emission, ou uma cor ao mundo",
    "Nothing to bake yet: add a mesh object, or the example room":
        "Ainda não há nada a calcular: acrescente uma malha, ou a sala de exemplo",
    "Looking at the scene ...": "A ler a cena ...",
    "object": "objeto",
    "objects": "objetos",
    "light": "luz",
    "lights": "luzes",
    "sky": "céu",
    "{} refused": "{} de fora",
    "mesh object": "malha",
    "mesh objects": "malhas",
    "{} hidden from the render: left out": "{} sem visibilidade no render: de fora",
    "{} was removed or renamed": "{} foi removido ou mudou de nome",
    "Colours between its vertices are {} off": "As cores entre os seus vértices têm um erro de {}",
    "Error {} in {}": "Erro {} em {}",
    "Error {}: above the target": "Erro {}: acima do pedido",
    "{} off between vertices": "Erro de {} entre os vértices",
    "{} is above 1, white here: try Exposure {} (F9)": "{} passa de 1, branco aqui: tente Exposição {} (F9)",
    "Subdivide and Bake Again": "Subdividir e calcular de novo",
    "Keep the Best So Far": "Ficar com o melhor até agora",
    "Error {}, target {}": "Erro {}, pedido {}",
    "{}, about {} left": "{}, faltam cerca de {}",
    ", error {}": ", erro {}",
    "Esc cancels": "Esc cancela",
    "{} cancelled, nothing was changed": "{}: cancelado, nada mudou",
    "Error against seconds; dotted: the target": "Erro e segundos; a ponteado: o pedido",
    "Reading the scene": "A ler a cena",
    "Solving": "A resolver",
    "Evaluating vertices": "A avaliar os vértices",
    "Evaluating passes": "A avaliar os passes",
    "Checking between vertices": "A verificar entre os vértices",
    "Checking the error": "A verificar o erro",
    "Estimating errors": "A estimar erros",
    "A bake is running": "Um cálculo está em curso",
    "Bake first": "Calcule primeiro",
    "The page is gone; run Error Against Time again": "A página já não existe; faça de novo Erro e tempo",
    "Bake to begin": "Calcule para começar",
    "What shapes the light has changed; bake again to go on": "Mudou o que forma a luz; calcule de novo para continuar",
    "{} MB kept": "{} MB guardados",
    ", {} ms a change": ", {} ms por mudança",
    # what was done
    "Baked {}, {}: estimated error {}, {} s; between vertices {}":
        "Calculados {}, {}: erro estimado {}, {} s; entre os vértices {}",
    "vertex": "vértice",
    "vertices": "vértices",
    "object refused": "objeto de fora",
    "objects refused": "objetos de fora",
    "thing left out or approximated": "coisa de fora ou aproximada",
    "things left out or approximated": "coisas de fora ou aproximadas",
    "warning": "aviso",
    "warnings": "avisos",
    "mesh": "malha",
    "meshes": "malhas",
    "material": "material",
    "materials": "materiais",
    "colour": "cor",
    "colours": "cores",
    "No mesh was subdivided": "Nenhuma malha foi subdividida",
    "No mesh is too coarse for the last target": "Nenhuma malha é demasiado grosseira para o último erro pedido",
    "{} subdivided, {} vertices more": "{} com subdivisão, mais {} vértices",
    "{} above 1 clipped, which {} cannot hold: lower the exposure":
        "{} acima de 1 com corte, que {} não guarda: baixe a exposição",
    "{} written to {}": "{} em {}",
    "{} now with {}": "{} agora com {}",
    "{} runs in {} s: {}": "{} cálculos em {} s: {}",
    "{} recognised, {} refused": "{} no cálculo, {} de fora",
    # the report
    "Objects baked": "Objetos calculados",
    "Vertices": "Vértices",
    "Error": "Erro",
    "Between vertices": "Entre os vértices",
    "Seconds": "Segundos",
    "{}: about {}": "{}: cerca de {}",
    "For tighter targets": "Para erros menores",
    "{}: violet none, green half, yellow {} of the mean light":
        "{}: violeta nenhum, verde metade, amarelo {} da luz média",
    "Warnings": "Avisos",
    "Notes": "Notas",
    "Left out or approximated": "De fora ou aproximado",
    "Plan": "Plano",
    "Own errors": "Erros próprios",
    "Time": "Tempo",
    "Said": "Dito",
    "and {} more": "e mais {}",
    "Read": "Ler",
    "Solve": "Resolver",
    "Evaluate": "Avaliar",
    "Check": "Verificar",
    "Write": "Escrever",
    "Total": "Total",
    "Solves this scene to ever tighter targets, up to a minute. Nothing is changed.":
        "Resolve esta cena com erros cada vez menores, até um minuto. Nada muda.",
    "With Cycles": "Com o Cycles",
    # buttons and their tooltips
    "Bake Radiosity": "Calcular radiosidade",
    "Solve the light between all objects that a render shows, and write it to a colour attribute":
        "Resolve a luz entre todos os objetos que um render mostra, e escreve-a num atributo de cor",
    "Cancel": "Cancelar",
    "End what runs: nothing is changed": "Termina o que está em curso: nada muda",
    "Stop solving and bake what there is, with its error": "Para de resolver e escreve o que há, com o seu erro",
    "Scan Scene": "Ler a cena",
    "List which objects take part in the bake and which do not, with the reason":
        "Lista os objetos que entram no cálculo e os que não, com a razão",
    "Mend": "Corrigir",
    "Do to this object what the bake needs": "Faz a este objeto o que o cálculo precisa",
    "Object": "Objeto",
    "Way": "Modo",
    "Make Single User": "Tornar usuário único",
    "Apply Modifiers": "Aplicar modificadores",
    "Flip Normals": "Inverter normais",
    "Convert to Mesh": "Converter em malha",
    "Make Instances Real": "Tornar instâncias reais",
    "Make Local": "Tornar local",
    "Add Example Room": "Acrescentar sala de exemplo",
    "Add a scene of a small room with a lamp, two balls and a box, to bake at once. Your scene stays as it is":
        "Acrescenta uma cena com uma pequena sala, pronta a calcular. A sua cena fica como está",
    "Show Baked Colours": "Mostrar as cores",
    "Show the colours as they are in every 3D view of this screen, without shading. Again: back to what it was":
        "Mostra as cores como são em todas as vistas 3D desta tela, sem sombreamento. De novo: volta ao que era",
    "Preview Material": "Material de prévia",
    "Show the baked colours in EEVEE and Cycles: adds nodes to the materials of the baked objects, which are taken out "
    "again by Remove Preview. The bake does not take them for light":
        "Mostra as cores no EEVEE e no Cycles: acrescenta nós aos materiais dos objetos calculados, que se tiram de "
        "novo. O cálculo não os toma por luz",
    "Remove": "Remover",
    "Take the preview out of all materials instead": "Tira antes a prévia de todos os materiais",
    "Subdivide for the Bake": "Subdividir para o cálculo",
    "Give the meshes that are too coarse for the baked light the vertices they need. Shapes, UVs, materials and "
    "attributes stay as they are":
        "Dá às malhas demasiado grosseiras para a luz os vértices que precisam. Formas, UVs, materiais e atributos "
        "ficam como estão",
    "Parts": "Partes",
    "Each face becomes this many by this many; 0: what the last report asks for":
        "Cada face passa a tantas por tantas; 0: o que o último relatório pede",
    "Method": "Método",
    "Where the new vertices go": "Onde ficam os novos vértices",
    "Adaptive": "Adaptativo",
    "Where the light bends, at edges of shadows most: the fewest vertices, in triangles":
        "Onde a luz varia, sobretudo nas bordas das sombras: menos vértices, em triângulos",
    "Uniform": "Uniforme",
    "Evenly, each face as a grid of quads: many more vertices, for meshes to work on further":
        "Por igual, cada face como grade de quadriláteros: muito mais vértices, para malhas a trabalhar ainda",
    "On Copies": "Em cópias",
    "Leave the objects as they are, hidden, and put subdivided copies in their places":
        "Deixa os objetos como estão, ocultos, e põe cópias subdivididas no lugar deles",
    "Evaluating where the light bends": "A ver onde a luz varia",
    "Subdividing": "A subdividir",
    "Most Vertices": "Máximo de vértices",
    "Of all these meshes together; the error stays larger where it is not enough":
        "De todas estas malhas juntas; o erro fica maior onde não chega",
    "Every object of the last bake that is too coarse": "Todos os objetos do último cálculo demasiado grosseiros",
    "Those among the selected; with a number of parts, every selected mesh":
        "Os que estão selecionados; com um número de partes, todas as malhas selecionadas",
    "Bake Again": "Calcular de novo",
    "In a window: start the bake with the sidebar's settings afterwards":
        "Numa janela: começa depois o cálculo com as opções da barra lateral",
    "Free": "Libertar",
    "New colours, emission, lights and world strengths are in the colours at once, until something moves. Bakes first, "
    "to find out about the geometry":
        "Cores, emissão, luzes e intensidades do mundo novas ficam logo nas cores, até que algo se mova. Calcula "
        "primeiro, para conhecer a geometria",
    "Free the memory that Live takes. The colours stay as they are":
        "Liberta a memória usada por Ao vivo. As cores ficam como estão",
    "Solve this scene to ever tighter targets and show what each second buys. Nothing in the scene is changed":
        "Resolve esta cena com erros cada vez menores e mostra o que cada segundo compra. Nada muda na cena",
    "Seconds that the runs may take in all: sizes the ladder of targets": "Segundos para todos os cálculos juntos",
    "Tightest Target": "Menor erro pedido",
    "The last target, where time allows it: the others are measured against it":
        "O último erro pedido, se o tempo chega: os outros medem-se por ele",
    "Published Method": "Método publicado",
    "Also run plain PDM radiosity at growing patches and points":
        "Faz também a radiosidade PDM simples com mais e mais retalhos e pontos",
    "Cycles": "Cycles",
    "Also bake a copy with Cycles at growing samples, in a second Blender":
        "Calcula também uma cópia com o Cycles com mais e mais amostras, num segundo Blender",
    "Folder": "Pasta",
    "Where the page, JSON and CSV are written; empty: a new temporary folder":
        "Onde se escrevem a página, JSON e CSV; vazio: uma nova pasta temporária",
    "Open the page of the last run in the browser": "Abre a página do último cálculo no navegador",
    "Open the Page": "Abrir a página",
    "Export Baked": "Exportar",
    "Write the baked objects with their colours for other programs. The scene stays as it is":
        "Escreve os objetos calculados e as suas cores para outros programas. A cena fica como está",
    "File": "Arquivo",
    "Its ending is that of the format": "A extensão é a do formato",
    "Format": "Formato",
    "What the file is for": "Para que serve o arquivo",
    "glTF": "glTF",
    "COLOR_0, linear: radiance on unlit materials, irradiance times the materials' own colour":
        "COLOR_0, linear: radiância em materiais sem luz, irradiância vezes a cor própria dos materiais",
    "FBX": "FBX",
    "Vertex colours in sRGB, 8 bits where it is read": "Cores de vértice em sRGB, 8 bits onde é lido",
    "OBJ": "OBJ",
    "A colour a vertex behind its place, in sRGB: no hard edges, any brightness":
        "Uma cor por vértice depois da posição, em sRGB: sem arestas vivas, qualquer brilho",
    # settings
    "Which objects receive colours. Every recognised object lights the others either way":
        "Que objetos recebem cores. Todos os objetos reconhecidos iluminam os outros",
    "All": "Todos",
    "Every recognised object": "Todos os objetos reconhecidos",
    "Selected": "Selecionados",
    "The recognised objects among those selected": "Os objetos reconhecidos entre os selecionados",
    "Target Error": "Erro pedido",
    "Relative error of the indirect and direct light at which the solver stops: 0.01 is 1 % of the mean, halving it "
    "costs about twice the time":
        "Erro relativo da luz direta e indireta com que se para: 0.01 é 1 % da média, metade custa cerca do dobro do "
        "tempo",
    "How far off the light may be, relative to its mean": "Quanto a luz pode errar, em relação à sua média",
    "Draft 5 %": "Rascunho 5 %",
    "To place lights by": "Para colocar luzes",
    "Good 1 %": "Bom 1 %",
    "Hardly to be told from exact by eye": "A olho, quase igual ao exato",
    "Fine .25 %": "Fino .25 %",
    "Exact to the eye in flat gradients too": "Exato à vista também em gradientes suaves",
    "Custom": "Outro",
    "Any other target error": "Qualquer outro erro pedido",
    "Time Limit": "Limite de tempo",
    "Seconds of reading and solving, then the best result so far is baked with its estimated error. 0 sets no limit":
        "Segundos para ler e resolver; depois fica o melhor até então, com o seu erro estimado. 0: sem limite",
    "Attribute": "Atributo",
    "Name of the colour attribute to write. One of the same name is replaced, no other is touched":
        "Nome do atributo de cor a escrever. Um do mesmo nome é substituído, nenhum outro muda",
    "Quantity": "Grandeza",
    "What the colours mean": "O que as cores significam",
    "Radiance": "Radiância",
    "What a camera sees: emission and reflected light, with the surface's own colour":
        "O que uma câmara vê: emissão e luz refletida, com a cor própria da superfície",
    "Irradiance": "Irradiância",
    "Arriving light (irradiance / pi), without the surface's own colour and emission: multiply it by a texture":
        "Luz que chega (irradiância / pi), sem a cor própria nem emissão: multiplique-a por uma textura",
    "Domain": "Domínio",
    "Where the colours are stored": "Onde as cores são guardadas",
    "Automatic": "Automático",
    "Per point where one smooth surface covers the object, else per face corner":
        "Por ponto onde uma superfície suave cobre o objeto, senão por canto de face",
    "Point": "Ponto",
    "One colour a vertex; where surfaces meet in an edge, their mean":
        "Uma cor por vértice; onde superfícies se encontram numa aresta, a média",
    "Face Corner": "Canto de face",
    "One colour a face corner: hard edges stay hard": "Uma cor por canto de face: arestas vivas ficam vivas",
    "Data Type": "Tipo de dados",
    "How the colours are stored": "Como as cores são guardadas",
    "Color": "Cor",
    "Linear floating point, any brightness": "Linear em vírgula flutuante, qualquer brilho",
    "Byte Color": "Cor em bytes",
    "8 bits a channel, values above 1 are clipped (and counted)":
        "8 bits por canal, valores acima de 1 são cortados (e contados)",
    "Exposure": "Exposição",
    "Stops: the colours are multiplied by 2 to the power of this. 0 keeps the physical values":
        "Stops: as cores são multiplicadas por 2 elevado a isto. 0 mantém os valores físicos",
    "Blend": "Mistura",
    "What becomes of a colour layer that the meshes have already": "O que se faz com uma camada de cor já existente",
    "None": "Nenhuma",
    "The light alone": "Só a luz",
    "Multiply into": "Multiplicar por",
    "The layer times the light. The layer stays, Attribute gets the result":
        "A camada vezes a luz. A camada fica, Atributo recebe o resultado",
    "Add to": "Somar a",
    "The layer and the light. The layer stays, Attribute gets the result":
        "A camada mais a luz. A camada fica, Atributo recebe o resultado",
    "Layer": "Camada",
    "Name of the colour layer that the light is multiplied into or added to. It stays as it is":
        "Nome da camada de cor que é multiplicada pela luz ou somada a ela. Fica como está",
    "Error Map": "Mapa de erros",
    "Also write a second attribute, its name followed by Error: each vertex's estimated error as a colour, from violet"
    ", none, to yellow, the largest":
        "Escreve também um segundo atributo, o nome seguido de Error: o erro estimado de cada vértice como cor, de "
        "violeta, nenhum, a amarelo, o maior",
    "Passes": "Passes",
    "Also write these, as attributes of the same name followed by the pass's":
        "Escreve também estes, como atributos do mesmo nome seguido do nome do passe",
    "Direct": "Direta",
    "Light straight from lamps, emission and the world": "Luz que vem logo de lâmpadas, emissão e mundo",
    "Indirect": "Indireta",
    "Light by way of reflections: with Direct and the own emission all there is":
        "Luz por reflexões: com a direta e a emissão própria, é toda a que há",
    "Sky": "Céu",
    "The share of the sky that is seen, weighted by the cosine: 1 in the open":
        "A parte do céu que se vê, pesada pelo cosseno: 1 ao ar livre",
    "AO": "AO",
    "Ambient occlusion: the same share of where nothing is within the distance":
        "Oclusão ambiente: a mesma parte, de onde nada há dentro da distância",
    "AO Distance": "Distância de AO",
    "How far ambient occlusion looks": "Até onde vê a oclusão ambiente",
    "Objects that share a mesh are each baked on a copy of their own. Otherwise the first one's bake is all's":
        "Objetos que partilham uma malha são calculados cada um na sua cópia. Senão, o do primeiro é o de todos",
    "Modifiers that add, remove or join vertices or faces are applied, and the result is baked. "
    "Otherwise such an object takes part in the light and is not baked":
        "Modificadores que acrescentam, tiram ou unem vértices ou faces são aplicados, e o resultado é calculado. "
        "Senão, o objeto entra na luz e não é calculado",
    "Show When Done": "Mostrar no fim",
    "After a bake by the button, switch the 3D views of the screen to the baked colours":
        "Depois de um cálculo pelo botão, as vistas 3D da tela mostram as cores",
    "Live": "Ao vivo",
    "Keep what the next bake finds out about the geometry in memory: then a new colour, emission, light or world "
    "strength is in the colours at once, until something moves":
        "Guarda na memória o que o próximo cálculo descobre da geometria: então uma nova cor, emissão, luz ou força do "
        "mundo está logo nas cores, até que algo se mova",
}  # fmt: skip


def register():
    entries = {(context, text): word for text, word in WORDS.items() for context in CONTEXTS}
    entries |= {("*", text): word for text, word in SENTENCES.items()}
    bpy.app.translations.register(__name__, dict.fromkeys(LANGUAGES, entries))


def unregister():
    bpy.app.translations.unregister(__name__)
