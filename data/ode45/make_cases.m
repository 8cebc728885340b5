% Makes cases.txt beside this file: the free rigid body by Octave's ode45 at its tightest tolerances.
%
%   octave-cli make_cases.m
%
% The paper's accuracy test (section 4.1): moments (x, y, 1) with 0 < 1 - y <= x < y < 1, momentum of norm
% one in the first octant, one step h = 1, attitude from the identity. Then bodies in every order of the
% moments, momenta of other norms in all octants, and other h, forwards and backwards.
1;

function dy = rigid_body(~, y, moments)
    m = y(1:3);
    q = y(4:7);
    omega = m./moments;
    dy = [cross(m, omega); ...
          0.5*[-dot(q(2:4), omega); q(1)*omega + cross(q(2:4), omega)]];
end

function write_case(file, moments, m, h)
    options = odeset('RelTol', 2.3e-14, 'AbsTol', eps);
    [~, y] = ode45(@(t, y) rigid_body(t, y, moments), [0 h/2 h], [m; 1; 0; 0; 0], options);
    fprintf(file, ' %.17g', [moments; m; h; y(end, :)']);
    fprintf(file, '\n');
end

rand('twister', 903);
file = fopen(fullfile(fileparts(mfilename('fullpath')), 'cases.txt'), 'w');
made = 0;
while made < 40
    x = rand();
    y = rand();
    if 1 - y <= x && x < y
        m = abs(sqrt(-2*log(rand(3, 1))).*cos(2*pi*rand(3, 1)));
        write_case(file, [x; y; 1], m/norm(m), 1);
        made = made + 1;
    end
end
orders = perms(1:3);
for i = 1:20
    moments = sort(rand(3, 1)) + [0.3; 0.4; 0.5];
    m = (2*rand(3, 1) - 1)*2;
    h = (-1)^i*(0.1 + 3*rand());
    write_case(file, moments(orders(mod(i, 6) + 1, :)), m, h);
end
fclose(file);
